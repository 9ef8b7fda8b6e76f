#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/profile.hpp"

namespace spindle::catalogue {

/// Where the parts of a product's events stand in the block that brings them, looked up once.
class EventLayout {
 public:
  struct Field {
    const Parameter* parameter;
    std::size_t at;        ///< index of its first register in the block
    std::string key = {};  ///< in records: screw_count of event.screw-count
  };

  /// Requires a profile with events, which must outlive it. That the number, where there is one,
  /// and the kind stand in the block is a rule that every loaded profile keeps.
  explicit EventLayout(const Profile& profile);

  /// Requires a product that counts its events.
  [[nodiscard]] std::uint16_t number_of(RegisterView block) const { return block[number_at_]; }

  /// Empty for a value that the profile does not name.
  [[nodiscard]] std::optional<EventKind> kind_of(RegisterView block) const;

  /// Where the number of the preset stands that a result was made with; empty: nowhere.
  [[nodiscard]] std::optional<std::size_t> preset_at() const { return preset_at_; }

  /// All parameters of the block, in the order of the profile.
  [[nodiscard]] const std::vector<Field>& fields() const { return fields_; }

 private:
  const EventSpec* facts_;
  std::vector<Field> fields_ = {};
  std::size_t number_at_ = 0;
  std::size_t kind_at_ = 0;
  std::optional<std::size_t> preset_at_ = std::nullopt;
};

}  // namespace spindle::catalogue
