// The one way in which the harness writes a file.
#pragma once

#include <string>
#include <string_view>

namespace nscdd {

// Writes `bytes` to `path`.part and renames it to `path`: a reader meets the old file or the whole new one.
// Throws OutputError, with the part removed and an old file untouched.
void replace_file(const std::string& path, std::string_view bytes);

// Throws InputError if `path` would be in a folder that does not exist, to be asked before long work; "" is no file.
void require_folder(const std::string& path);

}  // namespace nscdd
