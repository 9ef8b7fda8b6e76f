#include "files/profile_run.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>

#include "files/profile_entries.hpp"
#include "files/yaml_map.hpp"

namespace spindle::files {
namespace {

using catalogue::CommandRegisterSpec;
using catalogue::CommandWordSpec;
using catalogue::MonitorSpec;
using catalogue::RunKind;
using catalogue::RunSpec;
using catalogue::RunWords;
using catalogue::StartActionSpec;

constexpr std::uint64_t last_register = std::numeric_limits<std::uint16_t>::max();

/// What may be selected before a start, as options behind two hyphens.
constexpr std::array<std::string_view, 2> selectable = {"preset", "direction"};

RunWords read_words(const YamlNode& node, Diagnostics& findings) {
  YamlMap map(node, findings);
  RunWords words;
  assign(words.forward, map.number<std::uint16_t>("forward", Need::required));
  assign(words.reverse, map.number<std::uint16_t>("reverse", Need::required));
  assign(words.decelerate, map.number<std::uint16_t>("decelerate", Need::required));
  assign(words.instant, map.number<std::uint16_t>("instant", Need::required));
  map.finish();
  return words;
}

void read_modes(const YamlNode& node, CommandWordSpec& run, Diagnostics& findings) {
  if (!expect(node, YamlNode::Kind::map, findings)) return;
  std::map<std::int64_t, RunWords> modes = run.modes.to_map();
  for (const YamlEntry& entry : node.entries) {
    const auto value = parse_integer(entry.key);
    if (value) {
      modes.insert_or_assign(*value, read_words(entry.value, findings));
    } else {
      findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
    }
  }
  run.modes = std::move(modes);
}

void read_functions(const YamlNode& node, catalogue::InputSpec& inputs, Diagnostics& findings) {
  expect(node, YamlNode::Kind::sequence, findings);
  std::vector<catalogue::InputFunction> functions;
  for (const YamlNode& item : node.items) {
    YamlMap map(item, findings);
    catalogue::InputFunction function;
    assign(function.number, map.number<std::uint16_t>("number", Need::required));
    function.bit = map.number<std::uint8_t>("bit");
    assign(function.evidence,
           map.word("evidence", "evidence", catalogue::evidence_words, Need::required));
    assign(function.source, map.text("source", Need::required));
    map.finish();
    functions.push_back(std::move(function));
  }
  inputs.functions = std::move(functions);
}

void read_inputs(const YamlNode& node, catalogue::InputSpec& inputs, Diagnostics& findings) {
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

void read_command(const YamlNode& node, CommandWordSpec& run, Need need, Diagnostics& findings) {
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

void read_codes_of_status(YamlMap& map, std::string_view key,
                          catalogue::List<std::int64_t>& codes) {
  const YamlNode* node = map.get(key);
  if (node == nullptr) return;
  expect(*node, YamlNode::Kind::sequence, map.findings());
  std::vector<std::int64_t> values;
  for (const YamlNode& item : node->items) {
    const auto value = to_unsigned(item, std::numeric_limits<std::uint32_t>::max(), map.findings());
    if (value) values.push_back(static_cast<std::int64_t>(*value));
  }
  codes = std::move(values);
}

/// Of a command word all is needed but load and warning; of a command register nothing is.
void read_status(const YamlNode& node, MonitorSpec& monitor, Need need, Diagnostics& findings) {
  YamlMap map(node, findings);
  assign(monitor.status, map.text("parameter", need));
  const YamlNode* running = map.get("running", need);
  const bool by_values = running != nullptr && running->kind == YamlNode::Kind::sequence;
  if (by_values) {
    read_codes_of_status(map, "running", monitor.running_values);
  } else if (const auto bit = map.number<std::uint8_t>("running")) {
    monitor.running = *bit;
  }
  read_codes_of_status(map, "stopped", monitor.stopped_values);
  for (auto [key, bit] : {std::pair("at-speed", &monitor.at_speed), {"busy", &monitor.busy}}) {
    if (const auto read = map.number<std::uint8_t>(key, need)) *bit = *read;
  }
  assign(monitor.command_speed, map.text("command-speed", need));
  assign(monitor.feedback_speed, map.text("feedback-speed", need));
  assign(monitor.load, map.text("load"));
  assign(monitor.alarm, map.text("alarm", need));
  assign(monitor.warning, map.text("warning"));
  map.finish();
}

void read_operation(const YamlNode& node, CommandWordSpec& run, Need need, Diagnostics& findings) {
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

void read_command_word(YamlMap& map, CommandWordSpec& word, Need need) {
  Diagnostics& findings = map.findings();
  if (const YamlNode* part = map.get("command", need)) read_command(*part, word, need, findings);
  if (const YamlNode* part = map.get("status", need)) {
    read_status(*part, word.monitor, need, findings);
  }
  if (const YamlNode* part = map.get("operation", need)) {
    read_operation(*part, word, need, findings);
  }
  assign(word.watchdog, map.text("watchdog"));
  assign(word.group, map.text("group"));
}

void read_selections(const YamlNode& node, StartActionSpec& facts, Diagnostics& findings) {
  YamlMap map(node, findings);
  std::vector<catalogue::StartOption> selections;
  for (const std::string_view option : selectable) {
    if (auto action = map.text(option)) {
      selections.push_back({option, std::move(*action)});
    }
  }
  facts.selections = std::move(selections);
  map.finish();
}

void read_start_action(YamlMap& map, StartActionSpec& facts, Need need) {
  assign(facts.start, map.text("start", need));
  if (const YamlNode* part = map.get("select")) read_selections(*part, facts, map.findings());
  assign(facts.alarm, map.text("alarm"));
}

void read_command_values(const YamlNode& node, CommandRegisterSpec& facts, Need need,
                         Diagnostics& findings) {
  YamlMap map(node, findings);
  assign(facts.command, map.text("parameter", need));
  assign(facts.forward, map.number<std::uint32_t>("forward", need));
  if (const auto value = map.number<std::uint32_t>("reverse")) facts.reverse = *value;
  if (const auto value = map.number<std::uint32_t>("stop")) facts.stop = *value;
  if (const auto value = map.number<std::uint32_t>("instant")) facts.instant = *value;
  map.finish();
}

void read_enable(const YamlNode& node, catalogue::EnableSpec& enable, Diagnostics& findings) {
  YamlMap map(node, findings);
  enable = {};
  assign(enable.parameter, map.text("parameter", Need::required));
  if (const auto bit = map.number<std::uint8_t>("bit")) enable.bit = *bit;
  assign(enable.value,
         map.number<std::uint32_t>("value", enable.bit ? Need::optional : Need::required));
  map.finish();
}

void read_stop(const YamlNode& node, CommandRegisterSpec& facts, Diagnostics& findings) {
  YamlMap map(node, findings);
  assign(facts.stop_register, map.text("parameter", Need::required));
  assign(facts.stop_value, map.number<std::uint32_t>("value", Need::required));
  map.finish();
}

void read_command_register(YamlMap& map, CommandRegisterSpec& facts, Need need) {
  Diagnostics& findings = map.findings();
  if (const YamlNode* part = map.get("command", need)) {
    read_command_values(*part, facts, need, findings);
  }
  if (const YamlNode* part = map.get("enable")) read_enable(*part, facts.enable, findings);
  if (const YamlNode* part = map.get("stop")) read_stop(*part, facts, findings);
  assign(facts.set_point, map.text("set-point"));
  if (const YamlNode* part = map.get("status")) {
    read_status(*part, facts.monitor, Need::optional, findings);
  }
  assign(facts.stopping, map.duration("stopping"));
}

/// A profile of another model than its base has nothing of the base's.
Need begin_model(RunSpec& run, RunKind kind, Need need) {
  if (run.kind() == kind) return need;
  switch (kind) {
    case RunKind::start_action:
      run.model = StartActionSpec{};
      break;
    case RunKind::command_word:
      run.model = CommandWordSpec{};
      break;
    case RunKind::command_register:
      run.model = CommandRegisterSpec{};
      break;
  }
  return Need::required;
}

}  // namespace

void read_run(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(node, findings);
  auto [run, need] = section_of(draft.profile.run);
  const auto named = map.word("model", "run model", catalogue::run_words);
  if (!named && map.get("model") != nullptr) return;  // its keys are not known
  const Need model = begin_model(run, named.value_or(run.kind()), need);
  assign(run.evidence, map.word("evidence", "evidence", catalogue::evidence_words, need));
  assign(run.source, map.text("source", need));
  assign(run.still_runs, map.text("still-runs"));
  if (auto* word = std::get_if<CommandWordSpec>(&run.model)) read_command_word(map, *word, model);
  if (auto* action = std::get_if<StartActionSpec>(&run.model)) {
    read_start_action(map, *action, model);
  }
  if (auto* values = std::get_if<CommandRegisterSpec>(&run.model)) {
    read_command_register(map, *values, model);
  }
  map.finish();
}

void derive_run(ProfileDraft& draft) {
  if (draft.run.entry != nullptr || draft.profile.run || draft.incomplete) return;
  const catalogue::Action* start = nullptr;
  for (const catalogue::Action& action : draft.profile.actions) {
    const bool starts = action.hazard == catalogue::Hazard::moves && action.value &&
                        action.stop_value && action.motion == catalogue::Motion::none;
    if (!starts) continue;
    if (start != nullptr) return;
    start = &action;
  }
  if (start == nullptr) return;
  draft.profile.run = RunSpec{.model = StartActionSpec{.start = start->name},
                              .evidence = start->evidence,
                              .source = start->source,
                              .is_derived = true};
}

}  // namespace spindle::files
