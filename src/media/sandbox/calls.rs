//! Seccomp filter: system calls that decoding and inference never need fail with EPERM. It is a deny list rather than
//! an allow list because new versions of the C library and of other libraries may use other calls.

use libc::c_long;
use seccompiler::{
    Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule, apply_filter,
    sock_filter,
};
use std::collections::BTreeMap;

/// List of system calls by their names in libc.
macro_rules! calls {
    ($($name:ident)*) => { &[$(libc::$name),*] };
}

/// Calls rejected with any arguments.
const DENIED: &[c_long] = calls![
    // Execution of programs and access to other processes.
    SYS_execve SYS_execveat SYS_ptrace SYS_process_vm_readv SYS_process_vm_writev SYS_pidfd_open SYS_pidfd_getfd
    SYS_pidfd_send_signal SYS_tkill SYS_rt_sigqueueinfo SYS_rt_tgsigqueueinfo SYS_kcmp SYS_process_madvise
    SYS_process_mrelease SYS_migrate_pages SYS_move_pages
    // Networks and other sockets; io_uring submits calls that seccomp cannot filter.
    SYS_socket SYS_socketpair SYS_connect SYS_bind SYS_listen SYS_accept SYS_accept4 SYS_sendmsg SYS_sendmmsg
    SYS_io_uring_setup SYS_io_uring_enter SYS_io_uring_register
    // Memory and messages shared by name or number, and memory not counted by `RLIMIT_DATA`.
    SYS_shmget SYS_shmat SYS_shmctl SYS_semget SYS_semctl SYS_semop SYS_semtimedop SYS_msgget SYS_msgctl SYS_msgsnd
    SYS_msgrcv SYS_mq_open SYS_mq_unlink SYS_memfd_create SYS_memfd_secret
    // File mode, owner, times and attributes, which Landlock does not cover.
    SYS_fchmod SYS_fchmodat SYS_fchown SYS_fchownat SYS_utimensat SYS_setxattr SYS_lsetxattr SYS_fsetxattr
    SYS_removexattr SYS_lremovexattr SYS_fremovexattr
    // System administration.
    SYS_mount SYS_umount2 SYS_pivot_root SYS_chroot SYS_move_mount SYS_open_tree SYS_fsopen SYS_fsmount
    SYS_mount_setattr SYS_setns SYS_unshare SYS_open_by_handle_at SYS_bpf SYS_perf_event_open SYS_userfaultfd
    SYS_add_key SYS_request_key SYS_keyctl SYS_init_module SYS_finit_module SYS_delete_module SYS_kexec_load SYS_reboot
];

/// Calls of newer kernels, numbered equally on all architectures: fchmodat2, setxattrat, removexattrat, file_setattr.
const DENIED_NEWER: &[c_long] = &[452, 463, 466, 469];

/// Calls whose first argument is a process id: rejected unless it is 0, the caller itself. A filter cannot distinguish
/// ids of the process's threads from others, so these are rejected too. Queries of scheduling, priority, affinity and
/// process groups (`sched_get*`, `getpriority`, `ioprio_get`, `getpgid`, `getsid`) change nothing and are allowed.
const DENIED_FOR_OTHER_PROCESSES: &[c_long] = calls![
    SYS_prlimit64 SYS_sched_setaffinity SYS_sched_setscheduler SYS_sched_setparam SYS_sched_setattr SYS_setpgid
    SYS_get_robust_list
];

/// Older forms of the calls above, which only some architectures have.
#[cfg(target_arch = "x86_64")]
const DENIED_LEGACY: &[c_long] = calls![
    SYS_fork SYS_vfork SYS_chmod SYS_chown SYS_lchown SYS_utime SYS_utimes SYS_futimesat
];
#[cfg(not(target_arch = "x86_64"))]
const DENIED_LEGACY: &[c_long] = &[];

/// Restricts this thread and the threads that it starts.
pub(crate) fn restrict() -> Result<(), Error> {
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> =
        DENIED.iter().chain(DENIED_NEWER).chain(DENIED_LEGACY).map(|call| (*call, Vec::new())).collect();
    // Messages with an address. Without one, `sendto` writes to a connected socket, such as the socket pair by which the
    // handler of Ctrl-C and SIGTERM wakes its thread.
    let address = SeccompCondition::new(4, SeccompCmpArgLen::Qword, SeccompCmpOp::Ne, 0)?;
    rules.entry(libc::SYS_sendto).or_default().push(SeccompRule::new(vec![address])?);
    let mut deny = |call: c_long, argument: u8, op: SeccompCmpOp, value: u64| {
        let condition = SeccompCondition::new(argument, SeccompCmpArgLen::Dword, op, value)?;
        rules.entry(call).or_default().push(SeccompRule::new(vec![condition])?);
        Ok::<_, Error>(())
    };
    // New processes; threads remain possible.
    deny(libc::SYS_clone, 0, SeccompCmpOp::MaskedEq(libc::CLONE_THREAD as u64), 0)?;
    for call in DENIED_FOR_OTHER_PROCESSES {
        deny(*call, 0, SeccompCmpOp::Ne, 0)?;
    }
    // Priorities of other processes, groups and users; IOPRIO_WHO_PROCESS is 1.
    for (call, process) in [(libc::SYS_setpriority, u64::from(libc::PRIO_PROCESS)), (libc::SYS_ioprio_set, 1)] {
        deny(call, 0, SeccompCmpOp::Ne, process)?;
        deny(call, 1, SeccompCmpOp::Ne, 0)?;
    }
    // Signals to other processes. `abort` signals its own process, and signal 0 only tests whether a process exists.
    // The owner of a file also receives signals.
    deny(libc::SYS_kill, 1, SeccompCmpOp::Ne, 0)?;
    deny(libc::SYS_tgkill, 0, SeccompCmpOp::Ne, u64::from(std::process::id()))?;
    for command in [libc::F_SETOWN, F_SETOWN_EX] {
        deny(libc::SYS_fcntl, 1, SeccompCmpOp::Eq, u64::from(command.unsigned_abs()))?;
    }
    // Core scheduling shared with another process, and clearing the parent death signal.
    for option in [libc::PR_SCHED_CORE, libc::PR_SET_PDEATHSIG] {
        deny(libc::SYS_prctl, 0, SeccompCmpOp::Eq, u64::from(option.unsigned_abs()))?;
    }
    // Anonymous shared memory is not counted by `RLIMIT_DATA`.
    let shared = u64::from((libc::MAP_SHARED | libc::MAP_ANONYMOUS).unsigned_abs());
    deny(libc::SYS_mmap, 3, SeccompCmpOp::MaskedEq(shared), shared)?;
    // Neither are stacks that grow by themselves.
    let grows = u64::from(libc::MAP_GROWSDOWN.unsigned_abs());
    deny(libc::SYS_mmap, 3, SeccompCmpOp::MaskedEq(grows), grows)?;
    // Injection of input into the user's terminal.
    deny(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCSTI)?;
    deny(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCLINUX)?;
    // The foreground process group of the terminal.
    deny(libc::SYS_ioctl, 1, SeccompCmpOp::Eq, libc::TIOCSPGRP)?;
    install(rules, libc::EPERM)?;
    // The flags of `clone3` are behind a pointer, which a filter cannot read: after ENOSYS, the C library uses `clone`.
    install([(libc::SYS_clone3, Vec::new())].into(), libc::ENOSYS)?;
    apply_filter(&X32_FILTER)
}

/// `fcntl` command that sets the owner of a file and the kind of owner; `libc` does not define it.
const F_SETOWN_EX: libc::c_int = 15;

fn install(rules: BTreeMap<i64, Vec<SeccompRule>>, errno: i32) -> Result<(), Error> {
    let arch = std::env::consts::ARCH.try_into()?;
    let denial = SeccompAction::Errno(errno.unsigned_abs());
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, denial, arch)?;
    apply_filter(&seccompiler::BpfProgram::try_from(filter)?)
}

/// Rejects call numbers from 2^30 up, where x86-64 has all calls again (x32): load the number; compare; EPERM; allow.
const X32_FILTER: [sock_filter; 4] = [
    sock_filter { code: (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16, jt: 0, jf: 0, k: 0 },
    sock_filter { code: (libc::BPF_JMP | libc::BPF_JGE | libc::BPF_K) as u16, jt: 0, jf: 1, k: 1 << 30 },
    sock_filter { code: RETURN, jt: 0, jf: 0, k: libc::SECCOMP_RET_ERRNO | libc::EPERM as u32 },
    sock_filter { code: RETURN, jt: 0, jf: 0, k: libc::SECCOMP_RET_ALLOW },
];
const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
