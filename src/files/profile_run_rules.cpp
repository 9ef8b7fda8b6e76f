#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "files/profile_rules.hpp"

namespace spindle::files {
namespace {

using catalogue::Action;
using catalogue::CommandRegisterSpec;
using catalogue::CommandWordSpec;
using catalogue::MonitorSpec;
using catalogue::Parameter;
using catalogue::RunWords;
using catalogue::StartActionSpec;

unsigned width_of(const Parameter& parameter) {
  constexpr unsigned bits = 16;
  return catalogue::register_count(parameter.encoding) * bits;
}

class RunRules {
 public:
  RunRules(const ProfileDraft& draft, Diagnostics& findings) : draft_(draft), findings_(findings) {}

  void check() {
    if (!draft_.profile.run) return;
    const catalogue::RunSpec& run = *draft_.profile.run;
    if (run.source.empty()) findings_.add_once(draft_.run.of("source"), "run has no source");
    if (const auto* facts = run.action()) check_start_action(*facts);
    if (const auto* facts = run.word()) check_command_word(*facts);
    if (const auto* facts = run.command_register()) check_command_register(*facts);
  }

 private:
  const Parameter* require(const std::string& name, const SourceLocation& at) {
    if (draft_.lacks(name)) {
      findings_.add_once(at, fmt::format("'{}' is no parameter of this profile", name));
    }
    const auto found = draft_.parameter_index.find(name);
    return found == draft_.parameter_index.end() ? nullptr
                                                 : &draft_.profile.parameters[found->second];
  }

  void require_optional(const std::string& name, const SourceLocation& at) {
    if (!name.empty()) require(name, at);
  }

  const Parameter* require_writable(const std::string& name, const SourceLocation& at) {
    const Parameter* parameter = require(name, at);
    if (parameter != nullptr && parameter->access == catalogue::Access::read_only) {
      findings_.add_once(at, fmt::format("{} cannot be written", name));
    }
    return parameter;
  }

  const Action* require_action(const std::string& name, const SourceLocation& at) {
    const auto& actions = draft_.profile.actions;
    const auto found = std::find_if(actions.begin(), actions.end(),
                                    [&](const Action& each) { return each.name == name; });
    if (found != actions.end()) return &*found;
    if (!draft_.incomplete) {
      findings_.add_once(at, fmt::format("'{}' is no action of this profile", name));
    }
    return nullptr;
  }

  // ---- start-action ----

  void check_start_action(const StartActionSpec& facts) {
    const SourceLocation at = draft_.run.of("start");
    const Action* start = require_action(facts.start, at);
    if (start != nullptr && (!start->value || !start->stop_value)) {
      findings_.add_once(at, fmt::format("{}: a start needs 'value' and 'stop'", facts.start));
    } else if (start != nullptr && start->confirm.empty()) {
      findings_.add_once(at, fmt::format("{}: a start needs 'confirm'", facts.start));
    }
    for (const catalogue::StartOption& selection : facts.selections) {
      require_action(selection.action, draft_.run.of("select"));
    }
    require_optional(facts.alarm, draft_.run.of("alarm"));
  }

  // ---- command-word ----

  void check_command_word(const CommandWordSpec& run) {
    check_words(run, draft_.run.of("command"));
    check_operations(run, draft_.run.of("operation"));
    const MonitorSpec& monitor = run.monitor;
    const SourceLocation status = draft_.run.of("status");
    for (const catalogue::Text* name :
         {&monitor.status, &monitor.command_speed, &monitor.feedback_speed, &monitor.alarm}) {
      require(*name, status);
    }
    check_monitor(monitor, status);
    require_optional(run.watchdog, draft_.run.of("watchdog"));
    require_optional(run.group, draft_.run.of("group"));
  }

  void check_words(const CommandWordSpec& run, const SourceLocation& at) {
    require_writable(run.command, at);
    require(run.mode, at);
    if (run.modes.empty()) findings_.add_once(at, "there is no mode in which the motor runs");
    for (const auto& [mode, words] : run.modes) check_mode(mode, words, run, at);
    check_inputs(run, at);
    if (((run.decelerate_always | run.instant_always) & run.starting) != 0) {
      findings_.add_once(at, "a word that stops in every mode has a bit that starts in one");
    }
    const unsigned lowest = run.select & (~unsigned{run.select} + 1U);
    const unsigned room = lowest == 0 ? 0 : run.select / lowest;
    if (room < run.last || ((room + 1) & room) != 0) {
      findings_.add_once(at, fmt::format("the bits {:#x} cannot select operation data up to {}",
                                         run.select, run.last));
    }
  }

  /// Every bit of a word has one function by which it is found on a driver.
  void check_inputs(const CommandWordSpec& run, const SourceLocation& at) {
    const catalogue::InputSpec& inputs = run.inputs;
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

  void check_mode(std::int64_t mode, const RunWords& words, const CommandWordSpec& run,
                  const SourceLocation& at) {
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

  void check_operations(const CommandWordSpec& run, const SourceLocation& at) {
    if (run.preferred < run.first || run.preferred > run.last) {
      findings_.add_once(at, "the preferred operation data is none of them");
    }
    constexpr int most = 64;
    if (run.last - run.first >= most) {
      findings_.add_once(at, fmt::format("more than {} sets of operation data", most));
      return;
    }
    for (std::uint16_t n = run.first; n <= run.last; ++n) {
      for (const catalogue::Text* pattern : {&run.speed, &run.acceleration, &run.deceleration}) {
        require_writable(catalogue::numbered_name(*pattern, n), at);
      }
    }
    require_optional(run.analog, at);
  }

  // ---- command-register ----

  void check_command_register(const CommandRegisterSpec& facts) {
    check_values(facts, draft_.run.of("command"));
    check_enable(facts, draft_.run.of("enable"));
    const SourceLocation stop = draft_.run.of("stop");
    if (!facts.stop_register.empty()) {
      check_fits(require_writable(facts.stop_register, stop), facts.stop_value, stop);
      if (facts.stop_register == facts.command) {
        findings_.add_once(stop, "the stop of the command register stands in 'command'");
      }
    }
    const SourceLocation set_point = draft_.run.of("set-point");
    if (!facts.set_point.empty()) require_writable(facts.set_point, set_point);
    if (draft_.profile.run->is_command(facts.set_point)) {
      findings_.add_once(set_point, "the set-point is a command, too");
    }
    check_monitor(facts.monitor, draft_.run.of("status"));
    constexpr Duration longest = std::chrono::minutes(5);
    if (facts.stopping <= Duration::zero() || facts.stopping > longest) {
      findings_.add_once(draft_.run.of("stopping"), "a stop takes more than 0 s and at most 300 s");
    }
  }

  void check_fits(const Parameter* parameter, std::optional<std::uint32_t> value,
                  const SourceLocation& at) {
    if (parameter == nullptr || !value) return;
    if (parameter->encoding.scale != Decimal(1)) {
      findings_.add_once(at, fmt::format("{}: a command has no scale", parameter->name));
    } else if (Decimal(std::int64_t{*value}) > catalogue::highest(parameter->encoding)) {
      findings_.add_once(at, fmt::format("{} does not take {}", parameter->name, *value));
    }
  }

  void check_values(const CommandRegisterSpec& facts, const SourceLocation& at) {
    const Parameter* command = require_writable(facts.command, at);
    for (const auto& value :
         {std::optional(facts.forward), facts.reverse, facts.stop, facts.instant}) {
      check_fits(command, value, at);
    }
    if (!facts.stop && facts.stop_register.empty()) {
      findings_.add_once(at, "nothing stops it: write 'stop' here, or the section 'stop'");
    }
    if (facts.instant && !facts.stop) findings_.add_once(at, "'instant' needs 'stop'");
    for (const auto& stop : {facts.stop, facts.instant}) {
      if (stop && (stop == facts.forward || stop == facts.reverse)) {
        findings_.add_once(at, "a stop equals a start");
      }
    }
    if (facts.reverse == facts.forward) findings_.add_once(at, "forward and reverse are the same");
  }

  void check_enable(const CommandRegisterSpec& facts, const SourceLocation& at) {
    const catalogue::EnableSpec& enable = facts.enable;
    if (enable.parameter.empty()) return;
    const Parameter* parameter = require_writable(enable.parameter, at);
    check_fits(parameter, enable.value, at);
    if (parameter != nullptr && enable.bit && *enable.bit >= width_of(*parameter)) {
      findings_.add_once(at, fmt::format("{} has no bit {}", enable.parameter, *enable.bit));
      return;
    }
    if (enable.parameter != facts.command) return;
    if (!enable.bit || !facts.stop) {
      findings_.add_once(at, "the command register is enabled by a 'bit', and has a 'stop'");
      return;
    }
    const std::uint32_t values =
        facts.forward | facts.reverse.value_or(0) | *facts.stop | facts.instant.value_or(0);
    if ((values >> *enable.bit & 1U) != 0) {
      findings_.add_once(
          at, fmt::format("bit {} enables, so no value of 'command' has it", *enable.bit));
    }
  }

  // ---- what a motor says ----

  void check_monitor(const MonitorSpec& monitor, const SourceLocation& at) {
    for (const catalogue::Text* name : {&monitor.command_speed, &monitor.feedback_speed,
                                        &monitor.load, &monitor.alarm, &monitor.warning}) {
      require_optional(*name, at);
    }
    if (monitor.status.empty()) {
      const bool says = monitor.running || !monitor.running_values.empty();
      if (says) findings_.add_once(at, "'running' needs the 'parameter' of the status");
      return;
    }
    const Parameter* status = require(monitor.status, at);
    const bool by_values = !monitor.running_values.empty() && !monitor.stopped_values.empty();
    if (!monitor.running && !by_values) {
      findings_.add_once(at,
                         "a status needs the bit 'running', or lists of the values that mean "
                         "'running' and 'stopped'");
    }
    for (const std::int64_t value : monitor.running_values) {
      const auto& stopped = monitor.stopped_values;
      if (std::find(stopped.begin(), stopped.end(), value) == stopped.end()) continue;
      findings_.add_once(at, fmt::format("status {} means 'running' and 'stopped'", value));
    }
    if (status == nullptr) return;
    // Of a command word's status the low half counts, as of the word itself.
    constexpr unsigned word_bits = 16;
    const unsigned width = draft_.profile.run->word() != nullptr ? word_bits : width_of(*status);
    for (const auto& bit : {monitor.running, monitor.at_speed, monitor.busy}) {
      if (!bit || *bit < width) continue;
      findings_.add_once(at, fmt::format("a status bit is 0 to {}", width - 1));
    }
  }

  const ProfileDraft& draft_;
  Diagnostics& findings_;
};

}  // namespace

void check_run_rules(const ProfileDraft& draft, Diagnostics& findings) {
  RunRules(draft, findings).check();
}

}  // namespace spindle::files
