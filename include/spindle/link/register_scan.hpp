#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "spindle/link/client.hpp"

namespace spindle::link {

/// Registers that answered, side by side.
struct RegisterRun {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t first = 0;
  Registers values = {};  ///< at least one

  [[nodiscard]] std::uint16_t last() const {
    return static_cast<std::uint16_t>(first + values.size() - 1);
  }
};

/// How blocks may be asked for.
struct BlockRules {
  std::uint16_t longest = modbus::max_read_count;
  std::uint16_t most_bits = modbus::max_read_bits;  ///< the same of coils and discrete inputs
  bool even_pairs = false;  ///< blocks begin at even addresses, and pairs are never split
  /// Reads whose answers would look like a spontaneous frame (table and count).
  std::vector<RegisterRange> forbidden_shapes = {};
};

/// The registers from `from` to `to`, both inclusive, without those in `left_out`.
std::vector<RegisterRange> ranges_between(modbus::RegisterTable table, std::uint16_t from,
                                          std::uint16_t to,
                                          const std::set<std::uint16_t>& left_out);

/// Finds which registers are there, block by block: one that is refused is halved until what is
/// left is one register, or one pair. Knows neither lines nor clocks. Of n registers it asks at
/// most 2n times, and once a block where all answer.
class RegisterScan {
 public:
  RegisterScan(const std::vector<RegisterRange>& wanted, BlockRules rules);

  /// The block to ask for next; the same until it was answered or refused. Empty: all is known.
  [[nodiscard]] std::optional<RegisterRange> next() const;
  /// The block was answered. Requires as many values as it has registers.
  void answer(RegisterView values);
  /// The tool says that it cannot show the block.
  void refuse();

  /// What answered so far, in the order that was asked for.
  [[nodiscard]] const std::vector<RegisterRun>& runs() const { return runs_; }
  /// Registers of which it is known whether they answer, of all that are wanted.
  [[nodiscard]] std::size_t known() const { return known_; }
  [[nodiscard]] std::size_t wanted() const { return wanted_; }
  [[nodiscard]] std::size_t answered() const { return answered_; }

 private:
  [[nodiscard]] std::uint16_t block_size(const RegisterRange& range) const;
  [[nodiscard]] bool is_forbidden(modbus::RegisterTable table, std::uint16_t count) const;
  void push(const RegisterRange& range);

  BlockRules rules_;
  std::vector<RegisterRange> pending_;  ///< the last one is next
  std::vector<RegisterRun> runs_ = {};
  std::size_t known_ = 0;
  std::size_t wanted_ = 0;
  std::size_t answered_ = 0;
};

}  // namespace spindle::link
