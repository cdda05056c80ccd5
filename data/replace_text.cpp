#include "data/replace_text.h"

#include <cstring>
#include <system_error>

#include "data/input_error.h"
#include "data/sync_to_disk.h"
#include "data/text_file.h"

namespace clothfit {

void replace_text(const std::string& text, const std::filesystem::path& file) {
  const auto refuse = [&file](int error_number) {
    throw InputError(file.string(),
                     std::string("cannot be written: ") + std::strerror(error_number),
                     "a writable place with room on its disk");
  };
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  // The end of the name says whether the content is compressed.
  const std::filesystem::path partial = folder / (".partial." + file.filename().string());
  write_text(text, partial);
  // Synced before it is renamed: a name must not reach the disk before its content.
  if (const int error_number = sync_to_disk(partial)) refuse(error_number);
  std::error_code error;
  std::filesystem::rename(partial, file, error);
  if (error) refuse(error.value());
  if (const int error_number = sync_to_disk(folder)) refuse(error_number);
}

}  // namespace clothfit
