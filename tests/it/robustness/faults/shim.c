// Preloaded into the program: lists the calls that change files beneath FAULT_ROOT by their call sites, and makes one of
// them fail, or kills the program there. What is counted lies in shared memory, so that child processes count on.
//   FAULT_ROOT    folder whose files count
//   FAULT_LOG     file that takes a line `site operation path` a call
//   FAULT_STATE   file of 65536 counters of 32 bits
//   FAULT_SITE    the site that fails, and FAULT_NTH the how manieth of its calls (from 1)
//   FAULT_ACTION  an error's number; 0: the process group is killed
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { SITES = 65536, FRAMES = 40, OWN_FRAMES = 9 };

static const char *root;
static int log_fd = -1;
static uint32_t *counts;
static uint32_t chosen = SITES, nth;
static int action;
static uintptr_t low, high;
static __thread int is_inside;

static int first_object(struct dl_phdr_info *info, size_t size, void *data) {
    (void)size, (void)data;
    low = info->dlpi_addr;
    for (int i = 0; i < info->dlpi_phnum; i++)
        if (info->dlpi_phdr[i].p_type == PT_LOAD) {
            uintptr_t end = low + info->dlpi_phdr[i].p_vaddr + info->dlpi_phdr[i].p_memsz;
            if (end > high) high = end;
        }
    return 1;
}

__attribute__((constructor)) static void begin(void) {
    root = getenv("FAULT_ROOT");
    const char *log = getenv("FAULT_LOG"), *state = getenv("FAULT_STATE"), *site = getenv("FAULT_SITE");
    if (!root || !state) return;
    if (log) log_fd = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    int fd = syscall(SYS_openat, AT_FDCWD, state, O_RDWR | O_CLOEXEC, 0644);
    counts = mmap(NULL, SITES * sizeof *counts, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    syscall(SYS_close, fd);
    if (counts == MAP_FAILED) _exit(99);
    if (site) {
        chosen = strtoul(site, NULL, 16);
        nth = strtoul(getenv("FAULT_NTH"), NULL, 10);
        action = atoi(getenv("FAULT_ACTION"));
    }
    void *frames[4];
    backtrace(frames, 4);
    dl_iterate_phdr(first_object, NULL);
}

// Whether the call is to fail; errno is set then.
static int fails(const char *operation, const char *path) {
    if (!counts || !path || is_inside || strncmp(path, root, strlen(root))) return 0;
    is_inside = 1;
    int was = errno;
    void *frames[FRAMES];
    int n = backtrace(frames, FRAMES), own = 0;
    uint64_t hash = 1469598103934665603ull;
    for (const char *c = operation; *c; c++) hash = (hash ^ (unsigned char)*c) * 1099511628211ull;
    for (int i = 0; i < n && own < OWN_FRAMES; i++) {
        uintptr_t at = (uintptr_t)frames[i];
        if (at < low || at >= high) continue;
        hash = (hash ^ (at - low)) * 1099511628211ull;
        own++;
    }
    uint32_t site = (hash ^ (hash >> 16) ^ (hash >> 32) ^ (hash >> 48)) % SITES;
    uint32_t count = __sync_add_and_fetch(&counts[site], 1);
    if (log_fd >= 0) {
        char line[5000];
        int length = snprintf(line, sizeof line, "%04x %s %s\n", site, operation, path);
        syscall(SYS_write, log_fd, line, length < (int)sizeof line ? length : (int)sizeof line - 1);
    }
    errno = was;
    is_inside = 0;
    if (site != chosen || count != nth) return 0;
    if (!action) syscall(SYS_kill, 0, SIGKILL);
    errno = action;
    return 1;
}

// Whether a call on an open file is to fail.
static int file_fails(const char *operation, int fd) {
    if (!counts || is_inside) return 0;
    char link[40], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = syscall(SYS_readlinkat, AT_FDCWD, link, path, sizeof path - 1);
    if (length <= 0) return 0;
    path[length] = 0;
    return fails(operation, path);
}

// Whether a call on a name beneath an open folder is to fail.
static int name_fails(const char *operation, int folder, const char *name) {
    if (!counts || is_inside) return 0;
    char link[40], path[8300];
    if (name[0] == '/') return fails(operation, name);
    snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
    ssize_t length = syscall(SYS_readlinkat, AT_FDCWD, folder == AT_FDCWD ? "/proc/self/cwd" : link, path, 4095);
    if (length <= 0) return 0;
    snprintf(path + length, sizeof path - length, "/%s", name);
    return fails(operation, path);
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define WRITES(flags) (((flags) & O_ACCMODE) != O_RDONLY || ((flags) & O_CREAT))
#define OPEN(name)                                                                       \
    int name(const char *path, int flags, ...) {                                         \
        va_list more;                                                                    \
        va_start(more, flags);                                                           \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;          \
        va_end(more);                                                                    \
        if (WRITES(flags) && name_fails("open", AT_FDCWD, path)) return -1;              \
        return NEXT(name)(path, flags, mode);                                            \
    }
#define OPENAT(name)                                                                     \
    int name(int folder, const char *path, int flags, ...) {                             \
        va_list more;                                                                    \
        va_start(more, flags);                                                           \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;          \
        va_end(more);                                                                    \
        if (WRITES(flags) && name_fails("open", folder, path)) return -1;                \
        return NEXT(name)(folder, path, flags, mode);                                    \
    }
OPEN(open)
OPEN(open64)
OPENAT(openat)
OPENAT(openat64)

ssize_t write(int fd, const void *data, size_t size) { return file_fails("write", fd) ? -1 : NEXT(write)(fd, data, size); }
ssize_t writev(int fd, const struct iovec *parts, int n) { return file_fails("write", fd) ? -1 : NEXT(writev)(fd, parts, n); }
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at) {
    return file_fails("write", fd) ? -1 : NEXT(pwrite64)(fd, data, size, at);
}
ssize_t copy_file_range(int from, off64_t *a, int to, off64_t *b, size_t size, unsigned flags) {
    return file_fails("write", to) ? -1 : NEXT(copy_file_range)(from, a, to, b, size, flags);
}
int ftruncate64(int fd, off64_t size) { return file_fails("write", fd) ? -1 : NEXT(ftruncate64)(fd, size); }
int fsync(int fd) { return file_fails("fsync", fd) ? -1 : NEXT(fsync)(fd); }
int fdatasync(int fd) { return file_fails("fsync", fd) ? -1 : NEXT(fdatasync)(fd); }
int rename(const char *from, const char *to) { return name_fails("rename", AT_FDCWD, to) ? -1 : NEXT(rename)(from, to); }
int renameat(int a, const char *from, int b, const char *to) {
    return name_fails("rename", b, to) ? -1 : NEXT(renameat)(a, from, b, to);
}
int renameat2(int a, const char *from, int b, const char *to, unsigned flags) {
    return name_fails("rename", b, to) ? -1 : NEXT(renameat2)(a, from, b, to, flags);
}
int mkdir(const char *path, mode_t mode) { return name_fails("mkdir", AT_FDCWD, path) ? -1 : NEXT(mkdir)(path, mode); }
int mkdirat(int folder, const char *path, mode_t mode) {
    return name_fails("mkdir", folder, path) ? -1 : NEXT(mkdirat)(folder, path, mode);
}
int unlink(const char *path) { return name_fails("unlink", AT_FDCWD, path) ? -1 : NEXT(unlink)(path); }
int unlinkat(int folder, const char *path, int flags) {
    return name_fails("unlink", folder, path) ? -1 : NEXT(unlinkat)(folder, path, flags);
}
int rmdir(const char *path) { return name_fails("unlink", AT_FDCWD, path) ? -1 : NEXT(rmdir)(path); }
