//! Seccomp: system calls that decoding and inference never need are refused with EPERM. A list of what is refused, not of
//! what is allowed: the C library and the foreign libraries may change what they call.

use libc::c_long;
use seccompiler::{
    Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule, apply_filter,
    sock_filter,
};
use std::collections::BTreeMap;

/// Refused with any arguments.
const REFUSED: &[c_long] = &[
    // Other programs and other processes.
    libc::SYS_execve,
    libc::SYS_execveat,
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_pidfd_open,
    libc::SYS_pidfd_getfd,
    libc::SYS_pidfd_send_signal,
    libc::SYS_tkill,
    libc::SYS_rt_sigqueueinfo,
    libc::SYS_rt_tgsigqueueinfo,
    // Networks and other sockets; io_uring makes calls that no filter sees.
    libc::SYS_socket,
    libc::SYS_socketpair,
    libc::SYS_connect,
    libc::SYS_bind,
    libc::SYS_listen,
    libc::SYS_accept,
    libc::SYS_accept4,
    libc::SYS_sendto,
    libc::SYS_sendmsg,
    libc::SYS_sendmmsg,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    // Memory and messages shared by name.
    libc::SYS_shmget,
    libc::SYS_semget,
    libc::SYS_msgget,
    // Mode, owner, times and attributes of files, which Landlock leaves alone.
    libc::SYS_fchmod,
    libc::SYS_fchmodat,
    libc::SYS_fchown,
    libc::SYS_fchownat,
    libc::SYS_utimensat,
    libc::SYS_setxattr,
    libc::SYS_lsetxattr,
    libc::SYS_fsetxattr,
    libc::SYS_removexattr,
    libc::SYS_lremovexattr,
    libc::SYS_fremovexattr,
    FCHMODAT2,
    SETXATTRAT,
    REMOVEXATTRAT,
    FILE_SETATTR,
    // The system.
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_pivot_root,
    libc::SYS_chroot,
    libc::SYS_move_mount,
    libc::SYS_open_tree,
    libc::SYS_fsopen,
    libc::SYS_fsmount,
    libc::SYS_mount_setattr,
    libc::SYS_setns,
    libc::SYS_unshare,
    libc::SYS_open_by_handle_at,
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_userfaultfd,
    libc::SYS_add_key,
    libc::SYS_request_key,
    libc::SYS_keyctl,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_kexec_load,
    libc::SYS_reboot,
];

/// Forms of the calls above that other processors never had.
#[cfg(target_arch = "x86_64")]
const REFUSED_FORMS: &[c_long] = &[
    libc::SYS_fork,
    libc::SYS_vfork,
    libc::SYS_chmod,
    libc::SYS_chown,
    libc::SYS_lchown,
    libc::SYS_utime,
    libc::SYS_utimes,
    libc::SYS_futimesat,
];
#[cfg(not(target_arch = "x86_64"))]
const REFUSED_FORMS: &[c_long] = &[];

// Calls of newer kernels, which have one number on all processors.
const FCHMODAT2: c_long = 452;
const SETXATTRAT: c_long = 463;
const REMOVEXATTRAT: c_long = 466;
const FILE_SETATTR: c_long = 469;

/// Restricts this thread and those it starts.
pub(crate) fn restrict() -> Result<(), Error> {
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> =
        REFUSED.iter().chain(REFUSED_FORMS).map(|call| (*call, Vec::new())).collect();
    let mut refuse = |call: c_long, argument: u8, op: SeccompCmpOp, value: u64| {
        let condition = SeccompCondition::new(argument, SeccompCmpArgLen::Dword, op, value)?;
        rules.entry(call).or_default().push(SeccompRule::new(vec![condition])?);
        Ok::<_, Error>(())
    };
    // A new process; threads go on.
    refuse(libc::SYS_clone, 0, SeccompCmpOp::MaskedEq(libc::CLONE_THREAD as u64), 0)?;
    // Signals to and limits of other processes; `abort` signals its own, and signal 0 asks whether one is alive.
    refuse(libc::SYS_kill, 1, SeccompCmpOp::Ne, 0)?;
    refuse(libc::SYS_tgkill, 0, SeccompCmpOp::Ne, u64::from(std::process::id()))?;
    refuse(libc::SYS_prlimit64, 0, SeccompCmpOp::Ne, 0)?;
    // Letters typed into the terminal in the name of the user.
    refuse(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCSTI)?;
    refuse(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCLINUX)?;
    install(rules, libc::EPERM)?;
    // The flags of `clone3` are out of a filter's sight: told that there is none, the C library calls `clone`.
    install([(libc::SYS_clone3, Vec::new())].into(), libc::ENOSYS)?;
    apply_filter(&OTHER_NUMBERS)
}

fn install(rules: BTreeMap<i64, Vec<SeccompRule>>, errno: i32) -> Result<(), Error> {
    let arch = std::env::consts::ARCH.try_into()?;
    let refusal = SeccompAction::Errno(errno.unsigned_abs());
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, refusal, arch)?;
    apply_filter(&seccompiler::BpfProgram::try_from(filter)?)
}

/// Refuses the numbers from 2^30 up, by which x86-64 has all calls a second time (x32): load the number; compare; EPERM;
/// allow.
const OTHER_NUMBERS: [sock_filter; 4] = [
    sock_filter { code: (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16, jt: 0, jf: 0, k: 0 },
    sock_filter { code: (libc::BPF_JMP | libc::BPF_JGE | libc::BPF_K) as u16, jt: 0, jf: 1, k: 1 << 30 },
    sock_filter { code: RETURN, jt: 0, jf: 0, k: libc::SECCOMP_RET_ERRNO | libc::EPERM as u32 },
    sock_filter { code: RETURN, jt: 0, jf: 0, k: libc::SECCOMP_RET_ALLOW },
];
const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
