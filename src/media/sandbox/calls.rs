//! Seccomp: system calls that decoding and inference never need are refused with EPERM. A list of what is refused, not of
//! what is allowed: the C library and the foreign libraries may change what they call.

use libc::c_long;
use seccompiler::{
    Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule, apply_filter,
    sock_filter,
};
use std::collections::BTreeMap;

/// System calls by libc's names of them.
macro_rules! calls {
    ($($name:ident)*) => { &[$(libc::$name),*] };
}

/// Refused with any arguments.
const REFUSED: &[c_long] = calls![
    // Other programs and other processes.
    SYS_execve SYS_execveat SYS_ptrace SYS_process_vm_readv SYS_process_vm_writev SYS_pidfd_open SYS_pidfd_getfd
    SYS_pidfd_send_signal SYS_tkill SYS_rt_sigqueueinfo SYS_rt_tgsigqueueinfo SYS_kcmp SYS_process_madvise
    SYS_process_mrelease SYS_migrate_pages SYS_move_pages
    // Networks and other sockets; io_uring makes calls that no filter sees.
    SYS_socket SYS_socketpair SYS_connect SYS_bind SYS_listen SYS_accept SYS_accept4 SYS_sendto SYS_sendmsg SYS_sendmmsg
    SYS_io_uring_setup SYS_io_uring_enter SYS_io_uring_register
    // Memory and messages shared by name or number, and memory that `RLIMIT_DATA` does not count.
    SYS_shmget SYS_shmat SYS_shmctl SYS_semget SYS_semctl SYS_semop SYS_semtimedop SYS_msgget SYS_msgctl SYS_msgsnd
    SYS_msgrcv SYS_mq_open SYS_mq_unlink SYS_memfd_create SYS_memfd_secret
    // Mode, owner, times and attributes of files, which Landlock leaves alone.
    SYS_fchmod SYS_fchmodat SYS_fchown SYS_fchownat SYS_utimensat SYS_setxattr SYS_lsetxattr SYS_fsetxattr
    SYS_removexattr SYS_lremovexattr SYS_fremovexattr
    // The system.
    SYS_mount SYS_umount2 SYS_pivot_root SYS_chroot SYS_move_mount SYS_open_tree SYS_fsopen SYS_fsmount
    SYS_mount_setattr SYS_setns SYS_unshare SYS_open_by_handle_at SYS_bpf SYS_perf_event_open SYS_userfaultfd
    SYS_add_key SYS_request_key SYS_keyctl SYS_init_module SYS_finit_module SYS_delete_module SYS_kexec_load SYS_reboot
];

/// Of newer kernels, with one number on all processors: fchmodat2, setxattrat, removexattrat, file_setattr.
const REFUSED_NEWER: &[c_long] = &[452, 463, 466, 469];

/// Calls whose first argument names a process: refused unless it is 0, the caller itself. A filter cannot distinguish the
/// ids of the process's own threads from other ids, so these are refused too. Queries of scheduling, priority, affinity and
/// process groups (`sched_get*`, `getpriority`, `ioprio_get`, `getpgid`, `getsid`) change nothing and are allowed.
const REFUSED_OF_OTHERS: &[c_long] = calls![
    SYS_prlimit64 SYS_sched_setaffinity SYS_sched_setscheduler SYS_sched_setparam SYS_sched_setattr SYS_setpgid
    SYS_get_robust_list
];

/// Forms of the calls above that other processors never had.
#[cfg(target_arch = "x86_64")]
const REFUSED_FORMS: &[c_long] = calls![
    SYS_fork SYS_vfork SYS_chmod SYS_chown SYS_lchown SYS_utime SYS_utimes SYS_futimesat
];
#[cfg(not(target_arch = "x86_64"))]
const REFUSED_FORMS: &[c_long] = &[];

/// Restricts this thread and those it starts.
pub(crate) fn restrict() -> Result<(), Error> {
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> =
        REFUSED.iter().chain(REFUSED_NEWER).chain(REFUSED_FORMS).map(|call| (*call, Vec::new())).collect();
    let mut refuse = |call: c_long, argument: u8, op: SeccompCmpOp, value: u64| {
        let condition = SeccompCondition::new(argument, SeccompCmpArgLen::Dword, op, value)?;
        rules.entry(call).or_default().push(SeccompRule::new(vec![condition])?);
        Ok::<_, Error>(())
    };
    // A new process; threads go on.
    refuse(libc::SYS_clone, 0, SeccompCmpOp::MaskedEq(libc::CLONE_THREAD as u64), 0)?;
    for call in REFUSED_OF_OTHERS {
        refuse(*call, 0, SeccompCmpOp::Ne, 0)?;
    }
    // Priorities of other processes, of groups and of users; IOPRIO_WHO_PROCESS is 1.
    for (call, process) in [(libc::SYS_setpriority, u64::from(libc::PRIO_PROCESS)), (libc::SYS_ioprio_set, 1)] {
        refuse(call, 0, SeccompCmpOp::Ne, process)?;
        refuse(call, 1, SeccompCmpOp::Ne, 0)?;
    }
    // Signals to other processes; `abort` signals its own, and signal 0 asks whether one is alive. The owner of a file
    // gets signals too.
    refuse(libc::SYS_kill, 1, SeccompCmpOp::Ne, 0)?;
    refuse(libc::SYS_tgkill, 0, SeccompCmpOp::Ne, u64::from(std::process::id()))?;
    for command in [libc::F_SETOWN, F_SETOWN_EX] {
        refuse(libc::SYS_fcntl, 1, SeccompCmpOp::Eq, u64::from(command.unsigned_abs()))?;
    }
    // Scheduling shared with another process; an end of dying with the parent.
    for option in [libc::PR_SCHED_CORE, libc::PR_SET_PDEATHSIG] {
        refuse(libc::SYS_prctl, 0, SeccompCmpOp::Eq, u64::from(option.unsigned_abs()))?;
    }
    // Shared memory without a file is not counted by `RLIMIT_DATA`.
    let shared = u64::from((libc::MAP_SHARED | libc::MAP_ANONYMOUS).unsigned_abs());
    refuse(libc::SYS_mmap, 3, SeccompCmpOp::MaskedEq(shared), shared)?;
    // Letters typed into the terminal in the name of the user.
    refuse(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCSTI)?;
    refuse(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCLINUX)?;
    // Its foreground processes.
    refuse(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCSPGRP)?;
    install(rules, libc::EPERM)?;
    // The flags of `clone3` are out of a filter's sight: told that there is none, the C library calls `clone`.
    install([(libc::SYS_clone3, Vec::new())].into(), libc::ENOSYS)?;
    apply_filter(&OTHER_NUMBERS)
}

/// `fcntl`'s command for the owner of a file with its kind, which `libc` does not name.
const F_SETOWN_EX: libc::c_int = 15;

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
