#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "spindle/link/client.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/followers.hpp"

namespace spindle::work {

struct LearnPlan {
  catalogue::LearnSpec where = {};
  catalogue::LearnedAction what = {};
  std::size_t changes = 3;     ///< on the tool, that have to be followed
  Duration idle_timeout = {};  ///< given up when nothing changed for so long
};

/// What is told while it goes on.
struct LearnNews {
  enum class Kind : std::uint8_t { ready, changed } kind = Kind::ready;
  std::uint16_t from = 0;      ///< of `changed`
  std::uint16_t to = 0;        ///< what is watched now
  std::size_t changes = 0;     ///< so far
  std::size_t candidates = 0;  ///< registers that still may be the one
};

/// How it ended.
enum class Learned : std::uint8_t {
  one,         ///< one register follows
  other,       ///< one follows, with other numbers than what is watched, or not the same each time
  several,     ///< more than one follows, and nothing more tells them apart
  none,        ///< none follows
  unreadable,  ///< the tool shows none of the registers
  idle,        ///< too little changed on the tool
};
inline constexpr auto learned_words = enum_table<Learned>({{"one", Learned::one},
                                                           {"other", Learned::other},
                                                           {"several", Learned::several},
                                                           {"none", Learned::none},
                                                           {"unreadable", Learned::unreadable},
                                                           {"idle", Learned::idle}});

struct LearnResult {
  Learned how = Learned::none;
  std::vector<Follower> followers = {};
  std::vector<std::uint16_t> numbers = {};  ///< what was watched: at first, and behind each change
  std::size_t readable = 0;                 ///< registers that were looked at
};

/// The action of this name that the profile says can be learned. Errors: `unknown_name` with a
/// suggestion; `usage` where the profile knows its register, or of nothing to learn.
Result<LearnPlan> plan_learning(const std::string& name, const catalogue::Profile& profile);

/// Reads the registers again and again while the user changes on the tool what is watched. Reads
/// only. Registers that the profile knows are not looked at. Errors: the tool does not answer, or
/// refuses what it showed before; an interrupt.
Result<LearnResult> learn_register(OpenTool& tool, const LearnPlan& plan, Clock& clock,
                                   const std::function<void(const LearnNews&)>& tell,
                                   const link::Progress& progress = {});

}  // namespace spindle::work
