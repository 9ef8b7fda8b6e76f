#pragma once

#include <map>
#include <string>
#include <vector>

#include "spindle/catalogue/profile.hpp"

namespace spindle::shipped {

/// Writes profiles as C++ source: constant data, with each list as an array of its own, equal ones
/// once. The types are those of the catalogue, so the source holds for the build that wrote it.
class TableWriter {
 public:
  /// A constant of this type and value; what is returned is its name.
  std::string add(const catalogue::Profile& profile);
  std::string add(const catalogue::SimulationSpec& facts);
  std::string add(const catalogue::CodeTables& tables);

  /// A string literal.
  static std::string quoted(std::string_view text);

  /// All that was added, in the order of need.
  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  template <typename T>
  std::string constant(const T& value);
  template <typename T>
  std::string expression(const T& value);
  template <typename T>
  std::string array_of(const T* first, std::size_t count);

  std::string source_;
  std::map<std::string, std::string> names_;  ///< of arrays, by what they hold
};

}  // namespace spindle::shipped
