// A library for LD_PRELOAD: lets a chosen call of the system fail, and counts the calls.
//
// CLOTHFIT_FAULT_FOLDER: only calls that concern files below this folder count.
//
// CLOTHFIT_FAULT: the call that fails, KIND:N:ERRNO, such as write:17:28. With N+ those after it
// fail too. Several are separated by commas.
//
// CLOTHFIT_FAULT_LOG: a file that receives a line `failed KIND PATH` for each call that failed,
// and a line `count KIND TOTAL` for each kind at exit.
//
// Standard input, output and error never count. Calls that the C library makes inside itself are
// not seen: what it reads and writes for `FILE` counts by calls of fopen, fread, fwrite, fflush and
// fclose.

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

namespace {

enum Kind {
  kOpenWrite,
  kOpenRead,
  kOpenFolder,
  kList,
  kRead,
  kWrite,
  kSync,
  kClose,
  kRename,
  kExchange,
  kMakeFolder,
  kRemove,
  kCut,
  kCopy,
  kLook,
  kKinds
};
constexpr std::array<const char*, kKinds> kNames = {
    "open_write", "open_read", "open_folder", "list",   "read", "write", "sync", "close",
    "rename",     "exchange",  "mkdir",       "remove", "cut",  "copy",  "look"};

std::array<std::atomic<long>, kKinds> calls{};

/// Returns the next definition of a function, that of the C library.
template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}
#define NEXT(name) next<decltype(&name)>(#name)

void note(const std::string& line) {
  const char* const log = std::getenv("CLOTHFIT_FAULT_LOG");
  if (!log) return;
  const long file = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND, 0666);
  if (file < 0) return;
  syscall(SYS_write, file, line.data(), line.size());
  syscall(SYS_close, file);
}

/// Returns the path behind a descriptor; empty where it has none.
std::string path_of(int descriptor) {
  std::array<char, PATH_MAX> path;
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const long length = syscall(SYS_readlinkat, AT_FDCWD, link.c_str(), path.data(), path.size());
  return length < 0 ? std::string() : std::string(path.data(), static_cast<size_t>(length));
}

std::string path_of(int folder, const char* name) {
  if (!name) return {};
  if (name[0] == '/') return name;
  if (folder != AT_FDCWD) return path_of(folder) + "/" + name;
  std::array<char, PATH_MAX> here;
  return (syscall(SYS_getcwd, here.data(), here.size()) > 0 ? here.data() : "") + std::string("/") +
         name;
}

/// Returns the error with which call number `call` of a kind fails; 0 where it does not.
int planned_error(Kind kind, long call) {
  const char* const plan = std::getenv("CLOTHFIT_FAULT");
  if (!plan) return 0;
  const std::string name = std::string(kNames[kind]) + ":";
  for (std::string_view rest = plan; !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    if (!one.starts_with(name)) continue;
    char* after = nullptr;
    const long planned = std::strtol(one.data() + name.size(), &after, 10);
    const bool stays = *after == '+';
    if (call == planned || (stays && call > planned)) return std::atoi(after + (stays ? 2 : 1));
  }
  return 0;
}

/// Counts a call that concerns `path`; says whether it must fail, and sets errno then.
bool fails(Kind kind, const std::string& path) {
  static const std::string folder = [] {
    const char* const given = std::getenv("CLOTHFIT_FAULT_FOLDER");
    return given ? std::string(given) + "/" : std::string("/nowhere/");
  }();
  const int error_before = errno;
  const bool counts = (path + "/").starts_with(folder);
  const int error = counts ? planned_error(kind, ++calls[kind]) : 0;
  if (error != 0) note(std::string("failed ") + kNames[kind] + " " + path + "\n");
  errno = error != 0 ? error : error_before;
  return error != 0;
}

bool fails(Kind kind, int descriptor) {
  return descriptor > STDERR_FILENO && fails(kind, path_of(descriptor));
}
bool fails(Kind kind, FILE* file) {
  return file && fails(kind, fileno(file));
}

Kind opening(int flags) {
  if (flags & O_DIRECTORY) return kOpenFolder;
  return (flags & O_ACCMODE) == O_RDONLY ? kOpenRead : kOpenWrite;
}
Kind opening(const char* mode) {
  return std::strpbrk(mode, "wa+") ? kOpenWrite : kOpenRead;
}

__attribute__((destructor)) void note_counts() {
  std::string lines;
  for (int kind = 0; kind < kKinds; ++kind)
    lines += std::string("count ") + kNames[static_cast<size_t>(kind)] + " " +
             std::to_string(calls[static_cast<size_t>(kind)]) + "\n";
  note(lines);
}

}  // namespace

// The C library's functions, under their names.
extern "C" {

#define OPEN(name)                                                                  \
  int name(const char* path, int flags, ...) {                                      \
    va_list more;                                                                   \
    va_start(more, flags);                                                          \
    const mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(more, mode_t) : 0; \
    va_end(more);                                                                   \
    if (fails(opening(flags), path_of(AT_FDCWD, path))) return -1;                  \
    return NEXT(name)(path, flags, mode);                                           \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                                \
  int name(int folder, const char* path, int flags, ...) {                          \
    va_list more;                                                                   \
    va_start(more, flags);                                                          \
    const mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(more, mode_t) : 0; \
    va_end(more);                                                                   \
    if (fails(opening(flags), path_of(folder, path))) return -1;                    \
    return NEXT(name)(folder, path, flags, mode);                                   \
  }
OPENAT(openat)
OPENAT(openat64)

int __open_2(const char* path, int flags) {
  return open(path, flags);
}
int __open64_2(const char* path, int flags) {
  return open(path, flags);
}

FILE* fopen(const char* path, const char* mode) {
  return fails(opening(mode), path_of(AT_FDCWD, path)) ? nullptr : NEXT(fopen)(path, mode);
}
FILE* fopen64(const char* path, const char* mode) {
  return fails(opening(mode), path_of(AT_FDCWD, path)) ? nullptr : NEXT(fopen64)(path, mode);
}

DIR* opendir(const char* path) {
  return fails(kOpenFolder, path_of(AT_FDCWD, path)) ? nullptr : NEXT(opendir)(path);
}
dirent* readdir(DIR* folder) {
  return fails(kList, dirfd(folder)) ? nullptr : NEXT(readdir)(folder);
}
dirent64* readdir64(DIR* folder) {
  return fails(kList, dirfd(folder)) ? nullptr : NEXT(readdir64)(folder);
}

ssize_t read(int file, void* to, size_t size) {
  return fails(kRead, file) ? -1 : NEXT(read)(file, to, size);
}
ssize_t pread(int file, void* to, size_t size, off_t at) {
  return fails(kRead, file) ? -1 : NEXT(pread)(file, to, size, at);
}
ssize_t pread64(int file, void* to, size_t size, off64_t at) {
  return fails(kRead, file) ? -1 : NEXT(pread64)(file, to, size, at);
}
ssize_t readv(int file, const iovec* pieces, int count) {
  return fails(kRead, file) ? -1 : NEXT(readv)(file, pieces, count);
}
size_t fread(void* to, size_t size, size_t count, FILE* file) {
  return fails(kRead, file) ? 0 : NEXT(fread)(to, size, count, file);
}

ssize_t write(int file, const void* from, size_t size) {
  return fails(kWrite, file) ? -1 : NEXT(write)(file, from, size);
}
ssize_t pwrite(int file, const void* from, size_t size, off_t at) {
  return fails(kWrite, file) ? -1 : NEXT(pwrite)(file, from, size, at);
}
ssize_t pwrite64(int file, const void* from, size_t size, off64_t at) {
  return fails(kWrite, file) ? -1 : NEXT(pwrite64)(file, from, size, at);
}
ssize_t writev(int file, const iovec* pieces, int count) {
  return fails(kWrite, file) ? -1 : NEXT(writev)(file, pieces, count);
}
size_t fwrite(const void* from, size_t size, size_t count, FILE* file) {
  return fails(kWrite, file) ? 0 : NEXT(fwrite)(from, size, count, file);
}
int fflush(FILE* file) {
  return fails(kWrite, file) ? EOF : NEXT(fflush)(file);
}

int fsync(int file) {
  return fails(kSync, file) ? -1 : NEXT(fsync)(file);
}
int fdatasync(int file) {
  return fails(kSync, file) ? -1 : NEXT(fdatasync)(file);
}

// A descriptor is free again also where closing it fails.
int close(int file) {
  const bool fail = fails(kClose, file);
  const int error = errno;
  const int status = NEXT(close)(file);
  if (fail) errno = error;
  return fail ? -1 : status;
}
int fclose(FILE* file) {
  const bool fail = fails(kClose, file);
  const int error = errno;
  const int status = NEXT(fclose)(file);
  if (fail) errno = error;
  return fail ? EOF : status;
}

int rename(const char* from, const char* to) {
  return fails(kRename, path_of(AT_FDCWD, to)) ? -1 : NEXT(rename)(from, to);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  return fails(kRename, path_of(to_folder, to)) ? -1
                                                : NEXT(renameat)(from_folder, from, to_folder, to);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned int flags) {
  return fails(kExchange, path_of(to_folder, to))
             ? -1
             : NEXT(renameat2)(from_folder, from, to_folder, to, flags);
}

int mkdir(const char* path, mode_t mode) {
  return fails(kMakeFolder, path_of(AT_FDCWD, path)) ? -1 : NEXT(mkdir)(path, mode);
}
int unlink(const char* path) {
  return fails(kRemove, path_of(AT_FDCWD, path)) ? -1 : NEXT(unlink)(path);
}
int unlinkat(int folder, const char* path, int flags) {
  return fails(kRemove, path_of(folder, path)) ? -1 : NEXT(unlinkat)(folder, path, flags);
}
int rmdir(const char* path) {
  return fails(kRemove, path_of(AT_FDCWD, path)) ? -1 : NEXT(rmdir)(path);
}
int remove(const char* path) {
  return fails(kRemove, path_of(AT_FDCWD, path)) ? -1 : NEXT(remove)(path);
}

int ftruncate(int file, off_t size) {
  return fails(kCut, file) ? -1 : NEXT(ftruncate)(file, size);
}
int ftruncate64(int file, off64_t size) {
  return fails(kCut, file) ? -1 : NEXT(ftruncate64)(file, size);
}

ssize_t sendfile(int to, int from, off_t* at, size_t size) {
  return fails(kCopy, to) ? -1 : NEXT(sendfile)(to, from, at, size);
}
ssize_t sendfile64(int to, int from, off64_t* at, size_t size) {
  return fails(kCopy, to) ? -1 : NEXT(sendfile64)(to, from, at, size);
}
ssize_t copy_file_range(int from, off64_t* from_at, int to, off64_t* to_at, size_t size,
                        unsigned int flags) {
  return fails(kCopy, to) ? -1 : NEXT(copy_file_range)(from, from_at, to, to_at, size, flags);
}

int stat(const char* path, struct stat* status) {
  return fails(kLook, path_of(AT_FDCWD, path)) ? -1 : NEXT(stat)(path, status);
}
int stat64(const char* path, struct stat64* status) {
  return fails(kLook, path_of(AT_FDCWD, path)) ? -1 : NEXT(stat64)(path, status);
}
int lstat(const char* path, struct stat* status) {
  return fails(kLook, path_of(AT_FDCWD, path)) ? -1 : NEXT(lstat)(path, status);
}
int lstat64(const char* path, struct stat64* status) {
  return fails(kLook, path_of(AT_FDCWD, path)) ? -1 : NEXT(lstat64)(path, status);
}
int fstat(int file, struct stat* status) {
  return fails(kLook, file) ? -1 : NEXT(fstat)(file, status);
}
int fstat64(int file, struct stat64* status) {
  return fails(kLook, file) ? -1 : NEXT(fstat64)(file, status);
}

}  // extern "C"
