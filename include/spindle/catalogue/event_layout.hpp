#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
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
    std::size_t form = 0;  ///< only blocks of so many registers have it; 0: all
  };

  /// Requires a profile with events, which must outlive it. That the number, where there is one,
  /// and the kind stand in the block is a rule that every loaded profile keeps.
  explicit EventLayout(const Profile& profile);

  /// Requires a product that counts its events.
  [[nodiscard]] std::uint16_t number_of(RegisterView block) const { return block[number_at_]; }

  /// Empty for a value that the profile does not name.
  [[nodiscard]] std::optional<EventKind> kind_of(RegisterView block) const;

  /// Whether a block has the size of one of this product's. All others here require it.
  [[nodiscard]] bool fits(RegisterView block) const { return facts_->has_form(block.size()); }

  /// What two blocks of one event have in common: where the profile says what tells events apart,
  /// its number and that, unless nothing of that is there (a tool whose clock is not set); else all
  /// but what says of curves.
  [[nodiscard]] Registers key_of(RegisterView block) const;

  /// The unit of its torques as the block says it, or that of the tool where no block says one.
  /// Empty: it is not known; so is one that the block says and the profile does not name.
  [[nodiscard]] std::string torque_unit_of(RegisterView block, std::string_view of_tool) const;

  /// The parameter of the block with this name; null: there is none.
  [[nodiscard]] const Field* find(std::string_view name) const;

  /// Where the number of the preset stands that a result was made with; empty: nowhere.
  [[nodiscard]] std::optional<std::size_t> preset_at() const { return preset_at_; }

  /// Whether this block has it.
  [[nodiscard]] static bool has(const Field& field, RegisterView block) {
    return field.form == 0 || field.form == block.size();
  }

  /// All parameters of the block in all its forms, in the order of the profile.
  [[nodiscard]] const std::vector<Field>& fields() const { return fields_; }

 private:
  void add(const Parameter& parameter, std::size_t at, std::size_t form);
  void note_curves(const CurveSpec& curves);

  const EventSpec* facts_;
  std::vector<Field> fields_ = {};
  std::size_t number_at_ = 0;
  std::size_t kind_at_ = 0;
  std::optional<std::size_t> preset_at_ = std::nullopt;
  std::vector<std::pair<std::size_t, std::size_t>> identity_ = {};  ///< first register, how many
  std::vector<std::size_t> curve_registers_ = {};
  std::optional<std::size_t> torque_unit_ = std::nullopt;  ///< of the fields
};

}  // namespace spindle::catalogue
