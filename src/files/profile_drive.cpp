#include "files/profile_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "files/profile_entries.hpp"
#include "files/yaml_map.hpp"

namespace spindle::files {
namespace {

using catalogue::RunFacts;
using catalogue::RunWords;

constexpr std::uint64_t last_register = std::numeric_limits<std::uint16_t>::max();

constexpr std::array<std::pair<std::string_view, catalogue::CodeTable>, 3> table_of_codes = {
    {{"error-codes", catalogue::CodeTable::error},
     {"warning-codes", catalogue::CodeTable::warning},
     {"refusals", catalogue::CodeTable::refusal}}};

RunWords read_words(const YamlNode& node, Findings& findings) {
  YamlMap map(node, findings);
  RunWords words;
  assign(words.forward, map.number<std::uint16_t>("forward", Need::required));
  assign(words.reverse, map.number<std::uint16_t>("reverse", Need::required));
  assign(words.decelerate, map.number<std::uint16_t>("decelerate", Need::required));
  assign(words.instant, map.number<std::uint16_t>("instant", Need::required));
  map.finish();
  return words;
}

void read_modes(const YamlNode& node, RunFacts& run, Findings& findings) {
  if (!expect(node, YamlNode::Kind::map, findings)) return;
  for (const YamlEntry& entry : node.entries) {
    const auto value = parse_integer(entry.key);
    if (value) {
      run.modes.insert_or_assign(*value, read_words(entry.value, findings));
    } else {
      findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
    }
  }
}

void read_functions(const YamlNode& node, catalogue::InputFacts& inputs, Findings& findings) {
  expect(node, YamlNode::Kind::sequence, findings);
  inputs.functions.clear();
  for (const YamlNode& item : node.items) {
    YamlMap map(item, findings);
    catalogue::InputFunction function;
    assign(function.number, map.number<std::uint16_t>("number", Need::required));
    function.bit = map.number<std::uint8_t>("bit");
    assign(function.evidence,
           map.word<catalogue::Evidence>("evidence", "evidence", evidence_words, Need::required));
    assign(function.source, map.text("source", Need::required));
    map.finish();
    inputs.functions.push_back(std::move(function));
  }
}

void read_inputs(const YamlNode& node, catalogue::InputFacts& inputs, Findings& findings) {
  YamlMap map(node, findings);
  assign(inputs.parameter, map.text("parameter", Need::required));
  if (const auto bits = map.range("bits", last_register, Need::required)) {
    inputs.first = static_cast<std::uint16_t>(bits->from);
    inputs.last = static_cast<std::uint16_t>(bits->to);
  }
  if (const YamlNode* functions = map.get("functions", Need::required)) {
    read_functions(*functions, inputs, findings);
  }
  map.finish();
}

void read_command(const YamlNode& node, RunFacts& run, Need need, Findings& findings) {
  YamlMap map(node, findings);
  assign(run.command, map.text("parameter", need));
  assign(run.mode, map.text("mode", need));
  if (const YamlNode* modes = map.get("modes", need)) read_modes(*modes, run, findings);
  assign(run.starting, map.number<std::uint16_t>("starting", need));
  assign(run.select, map.number<std::uint16_t>("select", need));
  if (const YamlNode* always = map.get("always", need)) {
    YamlMap words(*always, findings);
    assign(run.decelerate_always, words.number<std::uint16_t>("decelerate", Need::required));
    assign(run.instant_always, words.number<std::uint16_t>("instant", Need::required));
    words.finish();
  }
  if (const YamlNode* inputs = map.get("inputs")) read_inputs(*inputs, run.inputs, findings);
  map.finish();
}

void read_status(const YamlNode& node, RunFacts& run, Need need, Findings& findings) {
  YamlMap map(node, findings);
  assign(run.status, map.text("parameter", need));
  assign(run.running, map.number<std::uint8_t>("running", need));
  assign(run.at_speed, map.number<std::uint8_t>("at-speed", need));
  assign(run.busy, map.number<std::uint8_t>("busy", need));
  assign(run.command_speed, map.text("command-speed", need));
  assign(run.feedback_speed, map.text("feedback-speed", need));
  assign(run.load, map.text("load"));
  assign(run.alarm, map.text("alarm", need));
  assign(run.warning, map.text("warning"));
  map.finish();
}

void read_operation(const YamlNode& node, RunFacts& run, Need need, Findings& findings) {
  YamlMap map(node, findings);
  assign(run.speed, map.text("speed", need));
  assign(run.acceleration, map.text("acceleration", need));
  assign(run.deceleration, map.text("deceleration", need));
  if (const auto numbers = map.range("numbers", last_register, need)) {
    run.first = static_cast<std::uint16_t>(numbers->from);
    run.last = static_cast<std::uint16_t>(numbers->to);
  }
  assign(run.preferred, map.number<std::uint16_t>("preferred", need));
  if (const YamlNode* analog = map.get("analog")) {
    YamlMap choice(*analog, findings);
    assign(run.analog, choice.text("parameter", Need::required));
    assign(run.digital, choice.number<std::uint16_t>("digital", Need::required));
    assign(run.analog_to, choice.number<std::uint16_t>("up-to", Need::required));
    choice.finish();
  }
  map.finish();
}

// ---- rules ----

class DriveRules {
 public:
  DriveRules(const ProfileDraft& draft, Findings& findings) : draft_(draft), findings_(findings) {}

  void check() {
    if (draft_.profile.run) check_run(*draft_.profile.run);
    if (draft_.profile.refusals) check_refusals(*draft_.profile.refusals);
    check_lists();
    for (std::size_t i = 0; i < draft_.parameters.size(); ++i) {
      check_parameter(draft_.profile.parameters[i], draft_.parameters[i]);
    }
    for (std::size_t i = 0; i < draft_.actions.size(); ++i) {
      check_action(draft_.profile.actions[i], draft_.actions[i]);
    }
  }

 private:
  const catalogue::Parameter* known(const std::string& name) const {
    const auto found = draft_.parameter_index.find(name);
    return found == draft_.parameter_index.end() ? nullptr
                                                 : &draft_.profile.parameters[found->second];
  }

  const catalogue::Parameter* require(const std::string& name, const Position& at) {
    const catalogue::Parameter* parameter = known(name);
    if (draft_.lacks(name)) {
      findings_.add_once(at, fmt::format("'{}' is no parameter of this profile", name));
    }
    return parameter;
  }

  void require_optional(const std::string& name, const Position& at) {
    if (!name.empty()) require(name, at);
  }

  void check_run(const RunFacts& run) {
    check_words(run, draft_.run.of("command"));
    check_operations(run, draft_.run.of("operation"));
    const Position status = draft_.run.of("status");
    for (const std::string* name :
         {&run.status, &run.command_speed, &run.feedback_speed, &run.alarm}) {
      require(*name, status);
    }
    require_optional(run.load, status);
    require_optional(run.warning, status);
    constexpr std::uint8_t highest_bit = 15;
    if (std::max({run.running, run.at_speed, run.busy}) > highest_bit) {
      findings_.add_once(status, fmt::format("a status bit is 0 to {}", highest_bit));
    }
    require_optional(run.watchdog, draft_.run.of("watchdog"));
    require_optional(run.group, draft_.run.of("group"));
    if (run.source.empty()) findings_.add_once(draft_.run.of("source"), "run has no source");
  }

  void check_words(const RunFacts& run, const Position& at) {
    const catalogue::Parameter* command = require(run.command, at);
    require(run.mode, at);
    if (command != nullptr && command->access == catalogue::Access::read_only) {
      findings_.add_once(at, fmt::format("{} cannot be written", run.command));
    }
    if (run.modes.empty()) findings_.add_once(at, "there is no mode in which the motor runs");
    for (const auto& [mode, words] : run.modes) check_mode(mode, words, run, at);
    check_inputs(run, at);
    if (((run.decelerate_always | run.instant_always) & run.starting) != 0) {
      findings_.add_once(at, "a word that stops in every mode has a bit that starts in one");
    }
    const unsigned lowest = run.select & (~unsigned{run.select} + 1U);
    const unsigned room = lowest == 0 ? 0 : run.select / lowest;
    if (room < run.last || ((room + 1) & room) != 0) {
      findings_.add_once(at, fmt::format("the bits {:#x} can not select operation data up to {}",
                                         run.select, run.last));
    }
  }

  /// Every bit of a word has one function by which it is found on a driver.
  void check_inputs(const RunFacts& run, const Position& at) {
    const catalogue::InputFacts& inputs = run.inputs;
    if (inputs.parameter.empty()) return;
    constexpr std::uint16_t highest_bit = 15;
    if (inputs.first > inputs.last || inputs.last > highest_bit) {
      findings_.add_once(at, fmt::format("the bits of inputs are 0 to {}", highest_bit));
      return;
    }
    for (std::uint16_t n = inputs.first; n <= inputs.last; ++n) {
      require(catalogue::numbered_name(inputs.parameter, n), at);
    }
    unsigned used =
        unsigned{run.select} | run.starting | run.decelerate_always | run.instant_always;
    for (const auto& [mode, words] : run.modes) {
      used |= unsigned{words.forward} | words.reverse | words.decelerate | words.instant;
    }
    unsigned known = 0;
    for (const catalogue::InputFunction& function : inputs.functions) {
      if (inputs.find(function.number) != &function) {
        findings_.add_once(at, fmt::format("function {} is there twice", function.number));
      }
      if (!function.bit) continue;
      if (*function.bit > highest_bit) {
        findings_.add_once(
            at, fmt::format("function {}: a bit is 0 to {}", function.number, highest_bit));
      } else if ((known >> *function.bit & 1U) != 0) {
        findings_.add_once(at, fmt::format("bit {} has two functions", *function.bit));
      } else {
        known |= 1U << *function.bit;
      }
    }
    for (unsigned bit = 0; bit <= highest_bit; ++bit) {
      const bool is_missing = ((used & ~known) >> bit & 1U) != 0;
      if (is_missing) findings_.add_once(at, fmt::format("bit {} has no function in inputs", bit));
    }
  }

  void check_mode(std::int64_t mode, const RunWords& words, const RunFacts& run,
                  const Position& at) {
    const unsigned all = unsigned{words.forward} | words.reverse | words.decelerate | words.instant;
    if ((all & run.select) != 0) {
      findings_.add_once(at, fmt::format("mode {}: a word has a bit that selects", mode));
    }
    const bool starts = (words.forward & run.starting) != 0 && (words.reverse & run.starting) != 0;
    if (!starts || words.forward == words.reverse) {
      findings_.add_once(at, fmt::format("mode {}: forward and reverse need bits that start, and "
                                         "differ",
                                         mode));
    }
    const bool stops = words.decelerate != words.forward && words.decelerate != words.reverse &&
                       words.instant != words.forward && words.instant != words.reverse;
    if (!stops) findings_.add_once(at, fmt::format("mode {}: a stop equals a start", mode));
  }

  void check_operations(const RunFacts& run, const Position& at) {
    if (run.preferred < run.first || run.preferred > run.last) {
      findings_.add_once(at, "the preferred operation data is none of them");
    }
    constexpr int most = 64;
    if (run.last - run.first >= most) {
      findings_.add_once(at, fmt::format("more than {} sets of operation data", most));
      return;
    }
    for (std::uint16_t n = run.first; n <= run.last; ++n) {
      for (const std::string* pattern : {&run.speed, &run.acceleration, &run.deceleration}) {
        const auto* parameter = require(catalogue::numbered_name(*pattern, n), at);
        if (parameter != nullptr && parameter->access == catalogue::Access::read_only) {
          findings_.add_once(at, fmt::format("{} cannot be written", parameter->name));
        }
      }
    }
    require_optional(run.analog, at);
  }

  void check_refusals(const catalogue::RefusalFacts& refusals) {
    require(refusals.parameter, draft_.refusals.of("parameter"));
    for (const std::int64_t code : refusals.busy) {
      if (refusals.codes.contains(code)) continue;
      findings_.add_once(draft_.refusals.of("busy"), fmt::format("code {} has no text", code));
    }
    const bool waits = refusals.retry_every > Duration::zero();
    if (!refusals.busy.empty() && !waits) {
      findings_.add_once(draft_.refusals.of("retry-every"), "waiting needs a time above zero");
    }
  }

  void check_lists() {
    // A pattern may mean what could not be read.
    if (draft_.incomplete || !draft_.half_read.empty()) return;
    for (const catalogue::AlarmList& list : draft_.profile.alarm_lists) {
      if (const auto found = draft_.profile.select(list.parameters); !found) {
        findings_.add_once(
            draft_.alarm_lists.entry->at,
            fmt::format("{}: {}: {}", list.name, found.error().name, message_of(found.error())));
      }
      if (list.codes == catalogue::CodeTable::refusal && draft_.refusals.entry == nullptr) {
        findings_.add_once(draft_.alarm_lists.entry->at,
                           fmt::format("{}: the profile has no refusals", list.name));
      }
    }
    if (draft_.profile.watched.empty()) return;
    if (const auto found = draft_.profile.select(draft_.profile.watched); !found) {
      findings_.add_once(draft_.watched.entry->at,
                         fmt::format("{}: {}", found.error().name, message_of(found.error())));
    }
  }

  void check_parameter(const catalogue::Parameter& parameter, const Origin& origin) {
    check_bits(parameter, origin);
    check_except(parameter, origin);
    if (parameter.effect && parameter.access == catalogue::Access::read_only) {
      findings_.add_once(origin.of("effect"),
                         fmt::format("{}: what is read-only has no effect", parameter.name));
    }
  }

  void check_bits(const catalogue::Parameter& parameter, const Origin& origin) {
    const unsigned width = catalogue::register_count(parameter.encoding.kind) * 16U;
    if (!parameter.bits_by.empty()) require(parameter.bits_by, origin.of("bits-by"));
    for (std::size_t i = 0; i < parameter.bits.size(); ++i) {
      const catalogue::BitName& bit = parameter.bits[i];
      if (bit.bit >= width) {
        findings_.add_once(origin.of("bits"),
                           fmt::format("{}: bit {} is behind the last", parameter.name, bit.bit));
      }
      if (bit.text.empty() || bit.text.find_first_of("+, ") != std::string::npos) {
        findings_.add_once(origin.of("bits"),
                           fmt::format("{}: '{}' is no name of a bit", parameter.name, bit.text));
      }
      for (std::size_t j = 0; j < i; ++j) check_pair(parameter, parameter.bits[j], bit, origin);
    }
    const bool unsuitable = parameter.encoding.scale != Decimal(1) || !parameter.labels.empty();
    if (!parameter.bits.empty() && unsuitable) {
      findings_.add_once(origin.of("bits"), fmt::format("{}: a bit field has neither scale nor "
                                                        "labels",
                                                        parameter.name));
    }
  }

  /// Two names that count at the same time need two bits, and differ.
  void check_pair(const catalogue::Parameter& parameter, const catalogue::BitName& a,
                  const catalogue::BitName& b, const Origin& origin) {
    const bool together = !a.when || !b.when || a.when == b.when;
    if (!together || (a.bit != b.bit && a.text != b.text)) return;
    findings_.add_once(origin.of("bits"), fmt::format("{}: bit {} and name '{}' are there twice",
                                                      parameter.name, b.bit, b.text));
  }

  void check_except(const catalogue::Parameter& parameter, const Origin& origin) {
    if (!parameter.except) return;
    const auto& [low, high] = *parameter.except;
    const auto& [minimum, maximum] = parameter.range;
    const bool inside =
        *low <= *high && (!minimum || *low > *minimum) && (!maximum || *high < *maximum);
    if (inside) return;
    findings_.add_once(origin.of("except"), fmt::format("{}: what is excepted is not inside its "
                                                        "range",
                                                        parameter.name));
  }

  void check_action(const catalogue::Action& action, const Origin& origin) {
    const bool pulses = action.rest.has_value();
    if (pulses && (!action.value || action.value == action.rest)) {
      findings_.add_once(origin.of("rest"),
                         fmt::format("{}: rest needs a value that differs from it", action.name));
    }
    if (action.motion != catalogue::Motion::none && draft_.run.entry == nullptr) {
      findings_.add_once(origin.of("motion"),
                         fmt::format("{}: a motion needs the section 'run'", action.name));
    }
    if (action.busy > Duration::zero() && draft_.run.entry == nullptr) {
      findings_.add_once(origin.of("busy"), fmt::format("{}: without the section 'run' no status "
                                                        "says that it is busy",
                                                        action.name));
    }
    const bool pair = catalogue::register_count(action.kind) == 2;
    if (pair && draft_.profile.link.even_pairs && action.address.value % 2 != 0) {
      findings_.add_once(origin.of("register"),
                         fmt::format("{}: a 32-bit value begins at an odd register, {}",
                                     action.name, action.address.value));
    }
  }

  const ProfileDraft& draft_;
  Findings& findings_;
};

}  // namespace

void read_run(const YamlNode& node, ProfileDraft& draft, Findings& findings) {
  YamlMap map(node, findings);
  auto [run, need] = section_of(draft.profile.run);
  assign(run.evidence, map.word<catalogue::Evidence>("evidence", "evidence", evidence_words, need));
  assign(run.source, map.text("source", need));
  if (const YamlNode* part = map.get("command", need)) read_command(*part, run, need, findings);
  if (const YamlNode* part = map.get("status", need)) read_status(*part, run, need, findings);
  if (const YamlNode* part = map.get("operation", need)) {
    read_operation(*part, run, need, findings);
  }
  assign(run.watchdog, map.text("watchdog"));
  assign(run.still_runs, map.text("still-runs"));
  assign(run.group, map.text("group"));
  map.finish();
}

void read_refusals(const YamlNode& node, ProfileDraft& draft, Findings& findings) {
  YamlMap map(node, findings);
  auto [refusals, need] = section_of(draft.profile.refusals);
  assign(refusals.parameter, map.text("parameter", need));
  if (const YamlNode* codes = map.get("codes", need)) {
    read_codes(*codes, refusals.codes, findings);
  }
  if (const YamlNode* busy = map.get("busy")) {
    expect(*busy, YamlNode::Kind::sequence, findings);
    refusals.busy.clear();
    for (const YamlNode& item : busy->items) {
      const auto code = to_unsigned(item, last_register, findings);
      if (code) refusals.busy.push_back(static_cast<std::int64_t>(*code));
    }
  }
  assign(refusals.retry_every, map.duration("retry-every"));
  assign(refusals.give_up_after, map.duration("give-up-after"));
  map.finish();
}

void read_alarm_lists(const YamlNode& node, ProfileDraft& draft, Findings& findings) {
  expect(node, YamlNode::Kind::sequence, findings);
  draft.profile.alarm_lists.clear();
  for (const YamlNode& item : node.items) {
    YamlMap map(item, findings);
    catalogue::AlarmList list;
    assign(list.name, map.text("list", Need::required));
    if (auto parameter = map.text("parameters", Need::required)) {
      list.parameters.push_back(std::move(*parameter));
    }
    assign(list.codes,
           map.word<catalogue::CodeTable>("codes", "table", table_of_codes, Need::required));
    map.finish();
    draft.profile.alarm_lists.push_back(std::move(list));
  }
}

void read_watched(const YamlNode& node, ProfileDraft& draft, Findings& findings) {
  expect(node, YamlNode::Kind::sequence, findings);
  draft.profile.watched.clear();
  for (const YamlNode& item : node.items) {
    if (auto name = to_text(item, findings)) draft.profile.watched.push_back(std::move(*name));
  }
}

void check_drive_rules(const ProfileDraft& draft, Findings& findings) {
  DriveRules(draft, findings).check();
}

}  // namespace spindle::files
