#include "data/replace_text.h"

#include <cstring>
#include <system_error>
#include <utility>

#include "data/input_error.h"
#include "data/partial_path.h"
#include "data/sync_to_disk.h"
#include "data/text_writer.h"

namespace clothfit {
namespace {

/// Removes a file at the end of its scope; where it was renamed, nothing is there.
class RemovedUnlessKept {
 public:
  explicit RemovedUnlessKept(std::filesystem::path file) : file_(std::move(file)) {}
  ~RemovedUnlessKept() {
    std::error_code error;
    std::filesystem::remove(file_, error);
  }
  RemovedUnlessKept(const RemovedUnlessKept&) = delete;
  RemovedUnlessKept& operator=(const RemovedUnlessKept&) = delete;

 private:
  std::filesystem::path file_;
};

}  // namespace

void replace_text(const std::string& text, const std::filesystem::path& file) {
  const auto refuse = [&file](int error_number) {
    throw InputError(file.string(),
                     std::string("cannot be written: ") + std::strerror(error_number),
                     "a writable place with room on its disk");
  };
  const std::filesystem::path whole = std::filesystem::absolute(file);
  const std::filesystem::path partial = partial_path(whole);
  remove_stale_partials(whole);
  // A link that somebody laid at this name must not lead the text elsewhere.
  TextWriter out(partial, WriteStart::create);
  const RemovedUnlessKept removed(partial);
  out.append(text);
  out.close();
  // Synced before it is renamed: a name must not reach the disk before its content.
  if (const int error_number = sync_to_disk(partial)) refuse(error_number);
  std::error_code error;
  std::filesystem::rename(partial, whole, error);
  if (error) refuse(error.value());
  if (const int error_number = sync_to_disk(whole.parent_path())) refuse(error_number);
}

}  // namespace clothfit
