#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::sim {

/// What a simulated tool makes of a write.
enum class WriteVerdict : std::uint8_t { allowed, no_such_register, outside_limits };

/// The registers of a simulated tool, laid out by its profile: named and numbered parameters, the
/// mirrors with their limits, the event block; start values, limits and holes from its start state.
/// A hole has no mirrors either. Keeps no reference to the profile.
class RegisterBank {
 public:
  RegisterBank(const catalogue::Profile& profile, const catalogue::SimulationSpec& start);

  /// Empty when one of the registers does not exist.
  [[nodiscard]] std::optional<Registers> read(modbus::RegisterTable table, std::uint16_t first,
                                              std::uint16_t count) const;

  [[nodiscard]] WriteVerdict check_write(std::uint16_t address, std::uint16_t value) const;
  /// Stores without asking; nothing happens when there is no such holding register.
  void store(std::uint16_t address, std::uint16_t value);

  /// A 16-bit parameter by name; 0 when the profile does not name it or it is a hole.
  [[nodiscard]] std::uint16_t get(std::string_view name) const;
  /// Nothing happens when the profile does not name it or it is a hole.
  void set(std::string_view name, std::uint16_t value);
  /// All registers of a parameter by name, the highest first. Nothing happens when the profile does
  /// not name it.
  void set_raw(std::string_view name, std::int64_t raw);

  /// Table and first address of a parameter by name; empty when the profile does not name it.
  [[nodiscard]] std::optional<std::pair<modbus::RegisterTable, std::uint16_t>> place_of(
      std::string_view name) const;

 private:
  struct Place {
    modbus::RegisterTable table = modbus::RegisterTable::holding;
    std::uint16_t address = 0;
    catalogue::Kind kind = catalogue::Kind::u16;
  };
  struct Limits {
    std::int64_t minimum = 0;
    std::int64_t maximum = 0;
    catalogue::Kind kind = catalogue::Kind::u16;
  };
  /// Words by their address: as quick to fill as memory.
  class Words {
   public:
    [[nodiscard]] bool has(std::uint16_t address) const {
      return address < there_.size() && there_[address];
    }
    /// Requires that it is there.
    [[nodiscard]] std::uint16_t at(std::uint16_t address) const { return words_[address]; }
    void put(std::uint16_t address, std::uint16_t word);
    void put_if_absent(std::uint16_t address, std::uint16_t word) {
      if (!has(address)) put(address, word);
    }
    void put_if_there(std::uint16_t address, std::uint16_t word) {
      if (has(address)) words_[address] = word;
    }
    void erase(std::uint16_t address) {
      if (has(address)) there_[address] = false;
    }

   private:
    std::vector<std::uint16_t> words_ = {};
    std::vector<bool> there_ = {};
  };
  struct Named {
    catalogue::Text name;
    Place place;
  };

  [[nodiscard]] const Words& words(modbus::RegisterTable table) const;
  [[nodiscard]] Words& words(modbus::RegisterTable table);
  void add_parameter(const catalogue::Parameter& parameter);
  void add_numbered(const catalogue::NumberedSpec& facts);
  void add_event_block(const catalogue::EventSpec& facts);
  [[nodiscard]] std::optional<Place> find(std::string_view name) const;
  [[nodiscard]] std::vector<Place> matching(std::string_view pattern) const;
  void add_numbered_matching(std::string_view pattern, std::vector<Place>& found) const;
  void start_value(const Place& place, std::int64_t raw);
  void start_limits(const Place& place, std::int64_t minimum, std::int64_t maximum);
  void add_mirrors(const catalogue::LimitSpec& facts);
  void remove(const catalogue::Area& area, const std::optional<catalogue::LimitSpec>& limits);

  std::vector<Named> named_ = {};  ///< by name
  std::optional<catalogue::NumberedSpec> numbered_ = std::nullopt;
  Words holding_ = {};
  Words input_ = {};
  std::map<std::uint16_t, Limits> writable_ = {};
};

}  // namespace spindle::sim
