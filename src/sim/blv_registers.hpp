#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/profile.hpp"

namespace spindle::sim {

/// The register pairs of a simulated BLV driver, laid out by its profile, with the values that it
/// stores and those that it had when it left the factory.
class BlvRegisters {
 public:
  static constexpr std::uint32_t count = 0x2000;

  BlvRegisters(const catalogue::Profile& profile, const catalogue::SimulationFacts& start);

  /// Requires registers below `count`.
  [[nodiscard]] Registers read(std::uint16_t first, std::uint16_t quantity) const;
  [[nodiscard]] std::uint32_t pair(std::uint16_t even) const;
  void set_pair(std::uint16_t even, std::uint32_t raw);

  /// Whether the profile names something at this pair that can be written, and whether it takes
  /// this value.
  enum class Verdict : std::uint8_t { allowed, not_writable, outside };
  [[nodiscard]] Verdict check(std::uint16_t even, std::uint32_t raw) const;

  /// By the name of a parameter; 0 or nothing where the profile does not name it.
  [[nodiscard]] std::int64_t get(std::string_view name) const;
  void set(std::string_view name, std::int64_t value);
  /// Puts a code in front of "NAME.1", "NAME.2", …, and forgets the last.
  void push_history(std::string_view name, std::int64_t code);
  void clear_history(std::string_view name);

  /// Stores what is not a command. What is stored is what a load or switching on brings back.
  void save() { stored_ = stored_part(); }
  void load();
  /// Initial values, in memory and stored.
  enum class Scope : std::uint8_t { without_communication, everything };
  void initialize(Scope scope);
  /// Begins anew as after switching on; the alarm history stays.
  void restart();

 private:
  using Pairs = std::map<std::uint16_t, std::uint32_t>;
  struct Place {
    std::uint16_t address = 0;
    catalogue::Kind kind = catalogue::Kind::u32;
    bool writable = false;
    bool stored = false;
    std::optional<std::int64_t> minimum = std::nullopt;
    std::optional<std::int64_t> maximum = std::nullopt;
    std::optional<std::pair<std::int64_t, std::int64_t>> except = std::nullopt;
  };

  void add(const catalogue::Parameter& parameter);
  void add(const catalogue::Action& action);
  [[nodiscard]] Pairs stored_part() const;

  Registers words_ = Registers(count, 0);
  std::map<std::string, Place, std::less<>> places_ = {};
  std::map<std::uint16_t, Place> by_address_ = {};
  Registers factory_ = {};
  Pairs stored_ = {};
};

}  // namespace spindle::sim
