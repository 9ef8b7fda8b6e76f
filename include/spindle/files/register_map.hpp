#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/enum_table.hpp"
#include "spindle/base/error.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::files {

/// How registers are counted.
enum class Numbering : std::uint8_t {
  address,  ///< from 0, as they are sent
  modicon,  ///< 40001 is the first holding register, 30001 the first input register
};
inline constexpr auto numbering_words =
    enum_table<Numbering>({{"address", Numbering::address}, {"modicon", Numbering::modicon}});

/// One register of a table, as a profile will have it.
struct MapEntry {
  std::string name;
  std::string title;
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t address = 0;
  std::string encoding = "u16";  ///< of the profile's words, or as it was written
  std::uint16_t length = 0;      ///< bytes of a text, digits of a bcd; 0: it has none
  std::string scale = {};        ///< a decimal number; empty: 1
  std::string unit = {};
  bool is_writable = false;
  std::string evidence = "inferred";
};

/// Why a row was left out; of a hint, why some rows may be wrong.
struct MapWarning {
  std::size_t line = 0;  ///< of the text, from 1
  std::string message;
};

struct RegisterMap {
  std::vector<MapEntry> entries = {};     ///< in the order of the rows
  std::vector<MapWarning> warnings = {};  ///< the first of them
  std::size_t faulty = 0;                 ///< rows that were left out
  std::string hint = {};                  ///< empty: there is none
};

/// Reads a table of registers with a header: columns `register` or `address`, `name`, `type`,
/// `scale`, `unit`, `access`, `description`, `table` and `evidence`, in any order and case, of
/// which the first alone is needed. Separators are commas, semicolons or tabs; fields may be
/// quoted. Rows that cannot be read are left out with a warning. Error `bad_file` where the text is
/// no such table: no header, a NUL, no UTF-8, a quote without an end, or more than 65536 rows.
Result<RegisterMap> read_register_map(std::string_view text, const std::string& path,
                                      Numbering numbering);

/// Whether a profile can be called so.
bool may_name_profile(std::string_view text);

/// The file of a profile that has these parameters, with comments that say what is to be completed.
/// `source` is where they come from; empty: nowhere.
std::string render_profile(const std::string& id, const RegisterMap& map,
                           const std::string& source);

}  // namespace spindle::files
