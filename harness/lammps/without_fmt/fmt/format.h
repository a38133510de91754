// In place of fmt. LAMMPS' headers name parts of a version of it that is not installed with them; nothing here is
// defined or called. A text for LAMMPS' Error has to be a std::string, for which no formatting is compiled.
#pragma once

namespace fmt {

class string_view;
class format_args;
template <class... Values>
format_args make_args_checked(const auto&... values);

}  // namespace fmt
