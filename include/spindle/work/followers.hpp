#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "spindle/catalogue/learning.hpp"

namespace spindle::work {

/// What was read at one moment: what the tool says happened, and registers by address.
struct Moment {
  std::uint16_t watched = 0;
  std::map<std::uint16_t, std::uint16_t> registers = {};
};

/// A register that still follows.
struct Follower {
  std::uint16_t address = 0;
  /// Whether it holds the very number that the tool says; else another one for each.
  bool is_equal = true;
  /// Of LearnedBy::clearing: what it showed each time; empty: not the same each time.
  std::optional<std::uint16_t> value = std::nullopt;
};

/// Leaves out registers that do not follow what a tool says, moment by moment. Pure. The moments
/// are given in their order; of a change of what is watched the first `settling` moments behind it
/// may still show the old state, as registers need not change at once.
class FollowerSearch {
 public:
  FollowerSearch(catalogue::LearnedBy by, const Moment& first, std::size_t settling = 2);

  /// Takes the next moment. Returns whether a change came to its end by it: what is watched has
  /// another number than before, and has had it for long enough.
  bool take(const Moment& moment);

  /// Changes that came to their end: of `clearing` only those to 0.
  [[nodiscard]] std::size_t changes() const { return numbers_.size() - 1; }
  /// What was watched: its first number, and that behind each change; of `clearing` that before it.
  [[nodiscard]] const std::vector<std::uint16_t>& numbers() const { return numbers_; }
  /// Registers that still may be the one.
  [[nodiscard]] std::set<std::uint16_t> candidates() const;
  /// Those that follow, once there were changes.
  [[nodiscard]] std::vector<Follower> followers() const;

 private:
  struct Candidate {
    std::map<std::uint16_t, std::uint16_t> held = {};  ///< by what was watched; of `value`
    // Of `clearing`:
    std::uint16_t rest = 0;   ///< what it holds while what is watched is not 0
    std::uint16_t now = 0;    ///< what it held at the last moment
    std::size_t moments = 0;  ///< for which it has not held that, while what is watched is not 0
    std::set<std::uint16_t> shown = {};                 ///< in the change under way, beside `rest`
    std::optional<std::uint16_t> value = std::nullopt;  ///< what it showed in the change before
    bool is_steady = true;                              ///< it showed that each time
  };

  bool take_value(const Moment& moment);
  bool take_clearing(const Moment& moment);
  void close_clearing();
  static bool keeps(Candidate& candidate, std::uint16_t watched, std::uint16_t now);
  /// Whether a candidate may still be the one although it holds this now.
  [[nodiscard]] bool clears(Candidate& candidate, std::uint16_t watched, std::uint16_t now) const;

  catalogue::LearnedBy by_;
  std::size_t settling_;
  std::map<std::uint16_t, Candidate> candidates_ = {};
  std::vector<std::uint16_t> numbers_;
  std::uint16_t last_;         ///< what was watched at the moment before
  std::size_t settled_ = 0;    ///< moments since it changed
  bool is_clearing_ = false;   ///< a change to 0 is under way
  std::uint16_t cleared_ = 0;  ///< what was watched before it
};

}  // namespace spindle::work
