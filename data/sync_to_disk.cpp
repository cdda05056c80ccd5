#include "data/sync_to_disk.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace clothfit {

int sync_to_disk(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int status = fsync(descriptor);
  const int error_number = errno;
  close(descriptor);
  // Some file systems cannot sync a folder and say so.
  return status == 0 || error_number == EINVAL ? 0 : error_number;
}

}  // namespace clothfit
