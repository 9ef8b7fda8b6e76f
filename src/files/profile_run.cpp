#include "files/profile_run.hpp"

#include <fmt/format.h>

#include <map>
#include <variant>

#include "files/fields.hpp"

namespace spindle::files {
namespace {

using catalogue::CommandRegisterSpec;
using catalogue::CommandWordSpec;
using catalogue::EnableSpec;
using catalogue::InputFunction;
using catalogue::InputSpec;
using catalogue::MonitorSpec;
using catalogue::RunKind;
using catalogue::RunSpec;
using catalogue::RunWords;
using catalogue::StartActionSpec;

constexpr Field<RunWords> word_fields[] = {
    field<&RunWords::forward>("forward", Need::required),
    field<&RunWords::reverse>("reverse", Need::required),
    field<&RunWords::decelerate>("decelerate", Need::required),
    field<&RunWords::instant>("instant", Need::required),
};

void read_modes(const YamlNode& node, CommandWordSpec& run, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::map, asked.findings)) return;
  std::map<std::int64_t, RunWords> modes = run.modes.to_map();
  for (const YamlEntry& entry : node.entries) {
    if (const auto value = parse_integer(entry.key)) {
      RunWords words;
      read_map(word_fields, entry.value, words, asked.findings);
      modes.insert_or_assign(*value, words);
    } else {
      asked.findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
    }
  }
  run.modes = std::move(modes);
}

constexpr Field<CommandWordSpec> always_fields[] = {
    field<&CommandWordSpec::decelerate_always>("decelerate", Need::required),
    field<&CommandWordSpec::instant_always>("instant", Need::required),
};

constexpr Field<InputFunction> function_fields[] = {
    field_as<std::uint16_t, &InputFunction::number>("number", Need::required),
    field<&InputFunction::bit>("bit"),
    word<catalogue::evidence_words, &InputFunction::evidence>("evidence", Need::required),
    field<&InputFunction::source>("source", Need::required),
};

constexpr Field<InputSpec> input_fields[] = {
    field<&InputSpec::parameter>("parameter", Need::required),
    range<&InputSpec::first, &InputSpec::last>("bits", Need::required),
    list_of<function_fields, &InputSpec::functions>("functions", Need::required),
};

constexpr Field<CommandWordSpec> command_fields[] = {
    field<&CommandWordSpec::command>("parameter", Need::inherited),
    field<&CommandWordSpec::mode>("mode", Need::inherited),
    custom("modes", Need::inherited, "maps by number", read_modes).with(keys_of<word_fields>),
    field<&CommandWordSpec::starting>("starting", Need::inherited),
    field<&CommandWordSpec::select>("select", Need::inherited),
    map_here<always_fields>("always", Need::inherited),
    map_of<input_fields, &CommandWordSpec::inputs>("inputs"),
};

void read_running(const YamlNode& node, MonitorSpec& monitor, const Asked& asked) {
  if (node.kind == YamlNode::Kind::sequence) {
    monitor.running_values = to_numbers<std::uint32_t>(node, asked.findings);
  } else {
    read_value(node, monitor.running, asked);
  }
}

/// Of a command word all is needed but load and warning; of a command register nothing is.
template <Need need>
constexpr Field<MonitorSpec> status_fields[] = {
    field<&MonitorSpec::status>("parameter", need),
    custom("running", need, "number 0..255, or list of numbers", read_running),
    numbers<std::uint32_t, &MonitorSpec::stopped_values>("stopped"),
    field<&MonitorSpec::at_speed>("at-speed", need),
    field<&MonitorSpec::busy>("busy", need),
    field<&MonitorSpec::command_speed>("command-speed", need),
    field<&MonitorSpec::feedback_speed>("feedback-speed", need),
    field<&MonitorSpec::load>("load"),
    field<&MonitorSpec::alarm>("alarm", need),
    field<&MonitorSpec::warning>("warning"),
};

constexpr Field<CommandWordSpec> analog_fields[] = {
    field<&CommandWordSpec::analog>("parameter", Need::required),
    field_as<std::uint16_t, &CommandWordSpec::digital>("digital", Need::required),
    field<&CommandWordSpec::analog_to>("up-to", Need::required),
};

constexpr Field<CommandWordSpec> operation_fields[] = {
    field<&CommandWordSpec::speed>("speed", Need::inherited),
    field<&CommandWordSpec::acceleration>("acceleration", Need::inherited),
    field<&CommandWordSpec::deceleration>("deceleration", Need::inherited),
    range<&CommandWordSpec::first, &CommandWordSpec::last>("numbers", Need::inherited),
    field<&CommandWordSpec::preferred>("preferred", Need::inherited),
    map_here<analog_fields>("analog"),
};

constexpr Field<CommandWordSpec> command_word_fields[] = {
    map_here<command_fields>("command", Need::inherited),
    map_of<status_fields<Need::inherited>, &CommandWordSpec::monitor>("status", Need::inherited),
    map_here<operation_fields>("operation", Need::inherited),
    field<&CommandWordSpec::watchdog>("watchdog"),
    field<&CommandWordSpec::group>("group"),
};

using Selections = std::vector<catalogue::StartOption>;

void read_selection(const YamlNode& node, Selections& selections, const Asked& asked) {
  catalogue::StartOption option{.option = asked.key.name};
  if (read_value(node, option.action, asked)) {
    selections.push_back(std::move(option));
  }
}

/// What may be selected before a start, as options behind two hyphens.
constexpr Field<Selections> selection_fields[] = {
    custom("preset", Need::optional, "text", read_selection),
    custom("direction", Need::optional, "text", read_selection),
};

void read_selections(const YamlNode& node, StartActionSpec& facts, const Asked& asked) {
  Selections selections;
  read_map(selection_fields, node, selections, asked.findings);
  facts.selections = std::move(selections);
}

constexpr Field<StartActionSpec> start_action_fields[] = {
    field<&StartActionSpec::start>("start", Need::inherited),
    custom("select", Need::optional, "map", read_selections).with(keys_of<selection_fields>),
    field<&StartActionSpec::alarm>("alarm"),
};

constexpr Field<CommandRegisterSpec> command_value_fields[] = {
    field<&CommandRegisterSpec::command>("parameter", Need::inherited),
    field<&CommandRegisterSpec::forward>("forward", Need::inherited),
    field<&CommandRegisterSpec::reverse>("reverse"),
    field<&CommandRegisterSpec::stop>("stop"),
    field<&CommandRegisterSpec::instant>("instant"),
};

constexpr Field<EnableSpec> enable_fields[] = {
    field<&EnableSpec::parameter>("parameter", Need::required),
    field<&EnableSpec::bit>("bit"),
    field<&EnableSpec::value>("value"),
};

void read_enable(const YamlNode& node, CommandRegisterSpec& facts, const Asked& asked) {
  facts.enable = {};
  YamlMap map(node, asked.findings);
  read_fields(enable_fields, map, facts.enable);
  if (!facts.enable.bit) map.require("value");
  map.finish();
}

constexpr Field<CommandRegisterSpec> stop_fields[] = {
    field<&CommandRegisterSpec::stop_register>("parameter", Need::required),
    field<&CommandRegisterSpec::stop_value>("value", Need::required),
};

constexpr Field<CommandRegisterSpec> command_register_fields[] = {
    map_here<command_value_fields>("command", Need::inherited),
    custom("enable", Need::optional, "map", read_enable).with(keys_of<enable_fields>),
    map_here<stop_fields>("stop"),
    field<&CommandRegisterSpec::set_point>("set-point"),
    map_of<status_fields<Need::optional>, &CommandRegisterSpec::monitor>("status"),
    field<&CommandRegisterSpec::stopping>("stopping"),
};

void begin_model(RunSpec& run, RunKind kind) {
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
}

struct RunHead {
  RunKind model;
};

constexpr Field<RunHead> model_fields[] = {
    word<catalogue::run_words, &RunHead::model>("model", Need::optional, "run model"),
};

constexpr Field<RunSpec> run_fields[] = {
    word<catalogue::evidence_words, &RunSpec::evidence>("evidence", Need::inherited),
    field<&RunSpec::source>("source", Need::inherited),
    field<&RunSpec::still_runs>("still-runs"),
};

}  // namespace

void read_run(const YamlNode& node, ProfileDraft& draft, const Asked& asked) {
  YamlMap map(node, asked.findings);
  bool inherited = draft.profile.run.has_value();
  RunSpec& run = inherited ? *draft.profile.run : draft.profile.run.emplace();
  RunHead head{run.kind()};
  const std::size_t before = asked.findings.told();
  read_fields(model_fields, map, head);
  if (asked.findings.told() != before) return;  // its keys are not known
  read_fields(run_fields, map, run, inherited);
  // A profile of another model than its base has nothing of the base's.
  if (head.model != run.kind()) {
    begin_model(run, head.model);
    inherited = false;
  }
  if (auto* word = std::get_if<CommandWordSpec>(&run.model)) {
    read_fields(command_word_fields, map, *word, inherited);
  } else if (auto* action = std::get_if<StartActionSpec>(&run.model)) {
    read_fields(start_action_fields, map, *action, inherited);
  } else if (auto* values = std::get_if<CommandRegisterSpec>(&run.model)) {
    read_fields(command_register_fields, map, *values, inherited);
  }
  map.finish();
}

std::vector<Key> run_keys() { return keys_of<model_fields, run_fields>(); }

std::vector<KeyList> run_model_keys() {
  return {{"start-action", keys_of<start_action_fields>()},
          {"command-word", keys_of<command_word_fields>()},
          {"command-register", keys_of<command_register_fields>()}};
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
