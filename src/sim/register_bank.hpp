#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::sim {

/// The registers of one table. As quick to fill as memory.
class Words {
 public:
  [[nodiscard]] bool has(std::uint16_t address) const {
    return address < there_.size() && there_[address];
  }
  [[nodiscard]] bool empty() const { return there_.empty(); }
  /// 0 where there is no such register.
  [[nodiscard]] std::uint16_t at(std::uint16_t address) const {
    return has(address) ? words_[address] : std::uint16_t{0};
  }
  /// Adds registers from `first` on that hold 0, up to that with the highest address; those that
  /// are there stay as they are.
  void add(std::uint16_t first, std::size_t count);
  /// Nothing happens when there is no such register.
  void put(std::uint16_t address, std::uint16_t word) {
    if (has(address)) words_[address] = word;
  }
  void erase(std::uint16_t address) {
    if (has(address)) there_[address] = false;
  }

 private:
  std::vector<std::uint16_t> words_ = {};
  std::vector<bool> there_ = {};
};

/// By modbus::RegisterTable. A coil or a discrete input is a register that holds 0 or 1.
struct Tables {
  std::array<Words, 4> all = {};
  [[nodiscard]] const Words& of(modbus::RegisterTable table) const {
    return all.at(static_cast<std::size_t>(table));
  }
  [[nodiscard]] Words& of(modbus::RegisterTable table) {
    return all.at(static_cast<std::size_t>(table));
  }
};

/// Where a value stands, and how.
struct Place {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t address = 0;  ///< of its first register
  catalogue::Encoding encoding = {};
  /// Where it is written; empty: where it stands.
  std::optional<std::uint16_t> write_address = std::nullopt;

  [[nodiscard]] std::uint16_t written_at() const { return write_address.value_or(address); }
  [[nodiscard]] unsigned size() const { return catalogue::register_count(encoding); }
  /// Behind its last register.
  [[nodiscard]] unsigned end() const { return address + size(); }
  /// Whether this register is one of the value's.
  [[nodiscard]] bool covers(modbus::RegisterTable of, std::uint16_t register_address) const {
    return of == table && register_address >= address && register_address < end();
  }
};

/// What is stored, without scale and offset, as the nearest integer; of several, the first. 0 where
/// it is no number.
std::int64_t stored_in(const catalogue::Encoding& encoding, RegisterView registers);

/// A value that the profile names.
struct Cell {
  Place place = {};
  bool writable = false;
  bool is_parameter = false;  ///< a value that stays, as opposed to a command
  bool needs_unlock = false;
  catalogue::Range range = {};  ///< as people read it
  std::optional<catalogue::Range> except = std::nullopt;

  /// Whether the value may be this. A date always may, as it is also written piece by piece.
  [[nodiscard]] bool takes(RegisterView registers) const;
};

/// What a write makes of one value.
struct Change {
  const Cell* cell = nullptr;  ///< null: there is none that can be written
  Registers registers = {};    ///< all of the value's, with those that are not written
};

/// The registers of a simulated device, laid out by its profile: named and numbered parameters,
/// commands, the device's own limits, the event block. Values begin at those of the start state,
/// else at their default, their least value or 0, texts empty, dates always at the same one; never
/// at what says that there is no value. Limits and holes are those of the start state, too. Values
/// may share registers. Keeps no reference to the profile.
class RegisterBank {
 public:
  /// Whether a register that only an action names can be read.
  enum class Commands : std::uint8_t { readable, write_only };
  RegisterBank(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
               Commands commands = Commands::readable);

  /// Adds those of these registers that are not there. They hold 0, and cannot be written.
  void fill(const catalogue::Area& area);

  /// Whether there is any register in this table.
  [[nodiscard]] bool has(modbus::RegisterTable table) const { return !tables_.of(table).empty(); }
  [[nodiscard]] bool has(modbus::RegisterTable table, std::uint16_t first, std::size_t count) const;
  /// Empty when one of the registers does not exist.
  [[nodiscard]] std::optional<Registers> read(modbus::RegisterTable table, std::uint16_t first,
                                              std::size_t count) const;
  /// One register, whatever it belongs to.
  void put(modbus::RegisterTable table, std::uint16_t address, std::uint16_t word) {
    tables_.of(table).put(address, word);
  }

  /// Reading these registers clears what says so.
  void note_read(modbus::RegisterTable table, std::uint16_t first, std::size_t count);

  /// Whether there is any value in this table.
  [[nodiscard]] bool has_cells(modbus::RegisterTable table) const;
  /// A value that can be written by this register; null when there is none.
  [[nodiscard]] const Cell* cell_at(modbus::RegisterTable table, std::uint16_t address) const;
  /// What writing these registers means, in the order of their addresses.
  [[nodiscard]] std::vector<Change> changes(modbus::RegisterTable table, std::uint16_t first,
                                            RegisterView values) const;
  /// Whether another register has to hold something else before this is written.
  [[nodiscard]] bool is_locked(const Cell& cell) const;

  [[nodiscard]] Registers registers(const Place& place) const;
  void put(const Place& place, RegisterView registers);
  /// The value as people read it; of several, the first. Empty where it is no number.
  [[nodiscard]] std::optional<Decimal> number(const Place& place) const;
  /// The nearest that it can be; of several, all. A text becomes empty.
  void set_number(const Place& place, const Decimal& number);
  /// What is stored, see stored_in(). A date is set by its seconds since 1970.
  [[nodiscard]] std::int64_t stored(const Place& place) const {
    return stored_in(place.encoding, registers(place));
  }
  void set_stored(const Place& place, std::int64_t stored) { set_stored(place, Decimal(stored)); }

  /// Empty when the profile does not name it.
  [[nodiscard]] std::optional<Place> find(std::string_view name) const;
  /// 0 when the profile does not name it or it is a hole.
  [[nodiscard]] std::int64_t get(std::string_view name) const;
  /// Nothing happens when the profile does not name it or it is a hole.
  void set(std::string_view name, std::int64_t value);
  /// A value in units of time, at most a day; `unit` is what 1 stands for.
  [[nodiscard]] Duration time(std::string_view name, Duration unit) const;

  /// All that the registers hold.
  [[nodiscard]] const Tables& tables() const { return tables_; }
  void set_tables(const Tables& tables) { tables_ = tables; }
  /// Copies parameters that can be written, but for those with these names.
  void copy_parameters(const Tables& from, Tables& into,
                       std::span<const std::string_view> but = {}) const;
  void take_parameters(const Tables& from, std::span<const std::string_view> but = {}) {
    copy_parameters(from, tables_, but);
  }

 private:
  struct Named {
    catalogue::Text name;
    Place place;
  };

  using Cells = std::vector<Cell>;

  /// In the order of their names.
  [[nodiscard]] std::vector<std::uint32_t>::const_iterator names_from(std::string_view name) const;
  [[nodiscard]] std::vector<const Cell*> cells_at(modbus::RegisterTable table,
                                                  std::uint16_t address) const;
  /// The first of those that are written by this register, or by one behind it.
  [[nodiscard]] Cells::const_iterator cells_from(modbus::RegisterTable table,
                                                 std::uint16_t address) const;
  [[nodiscard]] Change change_of(const Cell& cell, std::uint16_t first, RegisterView values) const;
  void set_stored(const Place& place, const Decimal& stored);
  void add(const Cell& cell);
  void sort_names();
  void add_registers(const Place& place);
  void add_parameter(const catalogue::Parameter& parameter, bool is_command);
  void begin(const catalogue::Parameter& parameter, const Cell& cell);
  void add_numbered(const catalogue::NumberedSpec& facts);
  void add_command(const catalogue::Action& action, bool even_pairs, Commands commands);
  void add_events(const catalogue::EventSpec& facts);
  /// Calls `visit` with each place that has a name like this.
  template <typename Visit>
  void for_each_match(std::string_view pattern, Visit visit) const;
  template <typename Visit>
  void for_each_number(std::string_view pattern, Visit visit) const;
  /// Looks at `next` first; what stands behind the cells of this place.
  Cells::iterator limit(const Place& place, std::int64_t minimum, std::int64_t maximum,
                        Cells::iterator next);
  void add_mirrors(const catalogue::LimitSpec& facts);
  void remove(const catalogue::Area& area, const std::optional<catalogue::LimitSpec>& limits);

  std::vector<Named> named_ = {};            ///< in the profile's order
  std::vector<std::uint32_t> by_name_ = {};  ///< indexes of `named_`, sorted
  std::optional<catalogue::NumberedSpec> numbered_ = std::nullopt;
  std::optional<catalogue::UnlockSpec> unlock_ = std::nullopt;
  Tables tables_ = {};
  Cells cells_ = {};                  ///< by the first register that writes them
  unsigned longest_ = 1;              ///< registers of the longest of them
  std::vector<Place> consumed_ = {};  ///< what reading clears
};

}  // namespace spindle::sim
