// The one way in which the harness writes a file.
#pragma once

#include <string>
#include <string_view>

namespace nscdd {

// Writes `bytes` to `path`.part and renames it to `path`: a reader meets the old file or the whole new one.
// Throws OutputError, with the part removed and an old file untouched.
void replace_file(const std::string& path, std::string_view bytes);

}  // namespace nscdd
