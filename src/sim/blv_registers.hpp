#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/catalogue/profile.hpp"

namespace spindle::sim {

/// The registers of a simulated driver, laid out by its profile, with the values that it stores
/// and those that it had when it left the factory. Takes every profile that is valid: any address,
/// both tables, values of one register and of two.
class BlvRegisters {
 public:
  enum class Layout : std::uint8_t {
    /// Registers up to the end of the map that have no name read as 0; values begin at 0.
    one_map,
    /// Registers without a name do not exist; values begin at their default, else at the least
    /// value, else at 0.
    exactly_as_named,
  };
  BlvRegisters(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
               Layout layout = Layout::one_map);

  /// Empty when a register does not exist.
  [[nodiscard]] std::optional<Registers> read(modbus::RegisterTable table, std::uint16_t first,
                                              std::size_t quantity) const;
  /// Whether so many holding registers are inside the map.
  [[nodiscard]] bool holds(std::uint16_t first, std::size_t quantity) const;
  /// Whether there are input registers at all.
  [[nodiscard]] bool has_input() const { return input_end_ > 0; }

  /// A value that can be written, as its registers: one or two.
  struct Cell {
    std::uint16_t first = 0;
    catalogue::Kind kind = catalogue::Kind::u16;
    bool operation = false;  ///< a command or operation data, as opposed to a parameter
  };
  /// The writable value that this holding register belongs to; empty when there is none.
  [[nodiscard]] std::optional<Cell> cell_at(std::uint16_t address) const;
  [[nodiscard]] std::uint32_t raw(const Cell& cell) const;
  /// The cell's value with those of its registers that are written from `first` on, beginning with
  /// values[next]; `next` is then that of the next cell.
  [[nodiscard]] std::uint32_t with_words(const Cell& cell, std::uint16_t first, RegisterView values,
                                         std::size_t& next) const;
  void set_raw(const Cell& cell, std::uint32_t raw);
  /// Whether the value takes this number.
  [[nodiscard]] bool takes(const Cell& cell, std::uint32_t raw) const;

  /// By the name of a parameter; 0 or nothing where the profile does not name it.
  [[nodiscard]] std::int64_t get(std::string_view name) const;
  void set(std::string_view name, std::int64_t value);
  /// A value in units of time, at most a day; `unit` is what 1 stands for.
  [[nodiscard]] Duration time(std::string_view name, Duration unit) const;
  /// Puts a code in front of "NAME.1", "NAME.2", …, and forgets the last.
  void push_history(std::string_view name, std::int64_t code);
  void clear_history(std::string_view name);

  /// Stores what is not a command. What is stored is what a load or switching on brings back.
  void save() { stored_ = stored_part(); }
  void load();
  /// Initial values, in memory and stored. Parity, stop bits and waiting time are the settings of
  /// the line.
  enum class Scope : std::uint8_t { without_the_line, everything };
  void initialize(Scope scope);
  /// Begins anew as after switching on; the alarm history stays.
  void restart();

 private:
  using Numbers = std::map<std::string, std::int64_t, std::less<>>;
  struct Place {
    modbus::RegisterTable table = modbus::RegisterTable::holding;
    Cell cell = {};
    bool writable = false;
    bool stored = false;
    Decimal scale = Decimal(1);
    std::optional<std::int64_t> minimum = std::nullopt;
    std::optional<std::int64_t> maximum = std::nullopt;
    std::optional<std::pair<std::int64_t, std::int64_t>> except = std::nullopt;
  };
  struct Memory {
    Registers holding;
    Registers input;
  };

  /// `is_word`: it is the word that commands the motor.
  void add(const catalogue::Parameter& parameter, bool is_word);
  void add(const catalogue::Action& action, bool even_pairs);
  void add(const catalogue::NumberedSpec& facts);
  void begin(const catalogue::Parameter& parameter);
  [[nodiscard]] bool exists(modbus::RegisterTable table, std::uint16_t first,
                            std::size_t quantity) const;
  void reach(const Place& place);
  [[nodiscard]] const Place* place_at(std::uint16_t address) const;
  [[nodiscard]] std::int64_t number(const Place& place) const;
  void set_number(const Place& place, std::int64_t number);
  [[nodiscard]] Numbers stored_part() const;

  Layout layout_;
  Memory words_;
  std::uint32_t holding_end_;  ///< first address that no request may reach
  std::uint32_t input_end_ = 0;
  std::map<std::string, Place, std::less<>> places_ = {};
  std::map<std::uint16_t, Place> by_address_ = {};  ///< of the holding table
  std::set<std::pair<modbus::RegisterTable, std::uint16_t>> named_ = {};
  Numbers factory_ = {};
  Numbers stored_ = {};
};

}  // namespace spindle::sim
