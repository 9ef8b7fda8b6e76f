#include "files/profile_entries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

using catalogue::Action;
using catalogue::Evidence;
using catalogue::Hazard;
using catalogue::Kind;
using catalogue::Label;
using catalogue::Parameter;

constexpr std::uint64_t last_register = std::numeric_limits<std::uint16_t>::max();

/// Repetitions multiply; a slip of the pen must not fill the memory.
constexpr std::size_t most_parameters = 10'000;

constexpr std::string_view counter = "{n}";

/// Longer ones would break every table.
constexpr std::size_t longest_unit = 12;

constexpr auto clone_words = enum_table<catalogue::Cloning>(
    {{"never", catalogue::Cloning::never}, {"allowed", catalogue::Cloning::allowed}});

constexpr auto reading_words = enum_table<catalogue::Reading>(
    {{"harmless", catalogue::Reading::harmless}, {"consumes", catalogue::Reading::consumes}});

constexpr auto notation_words = enum_table<catalogue::Notation>(
    {{"decimal", catalogue::Notation::decimal}, {"hex", catalogue::Notation::hexadecimal}});

constexpr auto motion_words = enum_table<catalogue::Motion>({{"start", catalogue::Motion::start},
                                                             {"stop", catalogue::Motion::stop},
                                                             {"", catalogue::Motion::none}});

/// One entry before it is repeated.
struct Template {
  Parameter parameter;
  NumberRange numbers = {};  ///< of {n}
  std::uint64_t stride = 0;
  std::optional<Evidence> repeats = std::nullopt;  ///< evidence of all but the first
  bool repeated = false;
  Origin origin = {};
};

std::vector<Label> read_labels(const YamlNode& map, Diagnostics& findings) {
  std::vector<Label> labels;
  expect(map, YamlNode::Kind::map, findings);
  for (const YamlEntry& entry : map.entries) {
    const auto number = parse_integer(entry.key);
    if (!number) {
      findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
    }
    auto text = to_text(entry.value, findings);
    if (number && text) labels.push_back({*number, std::move(*text)});
  }
  return labels;
}

/// "0..6.00", where either side may be left out.
std::optional<catalogue::Range> parse_limits(std::string_view text) {
  const std::size_t dots = text.find("..");
  if (dots == std::string_view::npos || text.size() == 2) return std::nullopt;
  const std::string_view low = text.substr(0, dots);
  const std::string_view high = text.substr(dots + 2);
  catalogue::Range range{Decimal::parse(low), Decimal::parse(high)};
  const bool wrong = (!low.empty() && !range.minimum) || (!high.empty() && !range.maximum);
  if (wrong) return std::nullopt;
  return range;
}

std::optional<catalogue::Range> read_decimals(YamlMap& map, std::string_view key) {
  const YamlNode* node = map.get(key);
  if (node == nullptr || !expect(*node, YamlNode::Kind::scalar, map.findings())) {
    return std::nullopt;
  }
  auto range = parse_limits(node->text);
  if (!range) {
    map.findings().add(node->at, fmt::format("'{}' is not a range such as 0..6.00", node->text));
  }
  return range;
}

void read_limits(YamlMap& map, Parameter& parameter) {
  assign(parameter.range, read_decimals(map, "range"));
  const auto except = read_decimals(map, "except");
  if (!except) return;
  if (except->minimum && except->maximum) {
    parameter.except = except;
  } else {
    map.findings().add(map.get("except")->at, "a hole in a range has two ends");
  }
}

void read_bit_names(const YamlNode& node, std::optional<std::int64_t> when,
                    std::vector<catalogue::BitName>& bits, Diagnostics& findings) {
  constexpr std::uint64_t highest_bit = 31;
  expect(node, YamlNode::Kind::map, findings);
  for (const YamlEntry& entry : node.entries) {
    const auto bit = parse_unsigned(entry.key, highest_bit);
    if (!bit) {
      findings.add(entry.key_at,
                   fmt::format("'{}' is not a bit from 0 to {}", entry.key, highest_bit));
    }
    auto text = to_text(entry.value, findings);
    if (bit && text) bits.push_back({static_cast<std::uint8_t>(*bit), std::move(*text), when});
  }
}

void read_bits_by(const YamlNode& by, Parameter& parameter, std::vector<catalogue::BitName>& bits,
                  Diagnostics& findings) {
  YamlMap choice(by, findings);
  assign(parameter.bits_by, choice.text("parameter", Need::required));
  const YamlNode* names = choice.get("names", Need::required);
  choice.finish();
  if (names == nullptr || !expect(*names, YamlNode::Kind::map, findings)) return;
  for (const YamlEntry& entry : names->entries) {
    const auto value = parse_integer(entry.key);
    if (!value) {
      findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
      continue;
    }
    read_bit_names(entry.value, *value, bits, findings);
  }
}

/// bits: {0: M0}, and those that depend on another parameter: bits-by: {parameter: NAME, names:
/// {0: {3: FWD}, 1: {3: START/STOP}}}.
void read_bits(YamlMap& map, Parameter& parameter) {
  std::vector<catalogue::BitName> bits;
  if (const YamlNode* node = map.get("bits")) {
    read_bit_names(*node, std::nullopt, bits, map.findings());
  }
  if (const YamlNode* by = map.get("bits-by")) read_bits_by(*by, parameter, bits, map.findings());
  parameter.bits = std::move(bits);
}

void read_scale(YamlMap& map, Parameter& parameter) {
  const auto scale = map.decimal("scale");
  if (!scale) return;
  if (*scale > Decimal(0)) {
    parameter.encoding.scale = *scale;
  } else {
    map.findings().add(map.node().at, "scale must be above zero");
  }
}

/// As documents print it; "torque" stands for the torque unit that is set on the tool.
void read_unit(YamlMap& map, Parameter& parameter) {
  auto unit = map.text("unit");
  if (!unit) return;
  const bool is_word = std::none_of(unit->begin(), unit->end(),
                                    [](unsigned char c) { return c <= ' ' || c == 0x7F; });
  if (is_word && unit->size() <= longest_unit) {
    parameter.unit = std::move(*unit);
  } else {
    map.findings().add(map.get("unit")->at,
                       fmt::format("a unit is one word of at most {} bytes", longest_unit));
  }
}

std::string read_name(YamlMap& map, const YamlNode* group) {
  if (group == nullptr) return map.text("name", Need::required).value_or("");
  map.allow("name");
  const YamlNode* prefix = group->find("name");
  const YamlNode* own = map.node().find("name");
  if (own == nullptr) {
    map.findings().add(map.node().at, "key 'name' is missing");
    return {};
  }
  return (prefix != nullptr ? prefix->text : std::string()) +
         to_text(*own, map.findings()).value_or("");
}

void read_repetition(YamlMap& map, Template& entry) {
  const auto numbers = map.range("n", last_register);
  const auto stride = map.number<std::uint16_t>("stride");
  entry.repeats = map.word("repeats", "evidence", catalogue::evidence_words);
  const bool has_counter = entry.parameter.name.view().find(counter) != std::string_view::npos;
  const bool has_range = map.get("n") != nullptr;
  if (has_counter != has_range) {
    map.findings().add(map.node().at, has_counter ? "the name has {n}, but key 'n' is missing"
                                                  : "key 'n' is given, but the name has no {n}");
    return;
  }
  if (!numbers) return;
  if (!stride || *stride == 0) {
    map.findings().add(map.node().at, "key 'n' needs a 'stride' above zero");
    return;
  }
  entry.repeated = true;
  entry.numbers = *numbers;
  entry.stride = *stride;
}

Template read_template(YamlMap& map, const YamlNode* group, bool& overlaps) {
  Template entry;
  Parameter& parameter = entry.parameter;
  parameter.name = read_name(map, group);
  assign(parameter.title, map.text("title", Need::required));
  assign(parameter.table, map.word("table", "table", modbus::table_words));
  if (auto address = map.number<std::uint16_t>("register", Need::required)) {
    parameter.address = {*address};
  }
  assign(parameter.encoding.kind,
         map.word("encoding", "encoding", catalogue::kind_words, Need::required));
  read_scale(map, parameter);
  read_unit(map, parameter);
  read_limits(map, parameter);
  parameter.default_value = map.decimal("default");
  if (const YamlNode* labels = map.get("labels")) {
    parameter.labels = read_labels(*labels, map.findings());
  }
  read_bits(map, parameter);
  assign(parameter.notation, map.word("notation", "notation", notation_words));
  assign(parameter.effect, map.word("effect", "effect", catalogue::effect_words));
  assign(parameter.risk, map.text("risk"));
  parameter.settle = map.duration("settle");
  assign(parameter.hazard, map.word("hazard", "hazard", catalogue::hazard_words));
  assign(parameter.access, map.word("access", "access", catalogue::access_words, Need::required));
  assign(parameter.reading, map.word("reading", "reading", reading_words));
  assign(parameter.evidence,
         map.word("evidence", "evidence", catalogue::evidence_words, Need::required));
  assign(parameter.source, map.text("source", Need::required));
  assign(parameter.note, map.text("note"));
  overlaps = map.flag("overlaps").value_or(false);
  assign(parameter.cloning, map.word("clone", "value of clone", clone_words));
  if (map.flag("secret").value_or(false)) parameter.secrecy = catalogue::Secrecy::secret;
  read_repetition(map, entry);
  return entry;
}

std::string substitute(std::string text, std::uint64_t number) {
  for (std::size_t at = text.find(counter); at != std::string::npos; at = text.find(counter, at)) {
    text.replace(at, counter.size(), std::to_string(number));
  }
  return text;
}

void add_parameter(Parameter parameter, const Origin& origin, ProfileDraft& draft,
                   Diagnostics& findings) {
  std::vector<Parameter>& parameters = draft.read_parameters;
  const auto [known, is_new] = draft.parameter_index.try_emplace(parameter.name, parameters.size());
  if (is_new) {
    parameters.push_back(std::move(parameter));
    draft.parameters.push_back(origin);
  } else if (draft.parameters[known->second].layer == origin.layer) {
    findings.add_once(origin.of("name"),
                      fmt::format("parameter '{}' is already there", parameter.name));
  } else {
    parameters[known->second] = std::move(parameter);
    draft.parameters[known->second] = origin;
  }
}

/// Adds repetition `step` (from 0) of an entry. False when there is none, or no room for it.
bool add_repetition(const Template& entry, std::uint64_t step, ProfileDraft& draft,
                    Diagnostics& findings) {
  const std::uint64_t n = entry.numbers.from + step;
  if (n > entry.numbers.to) return false;
  const std::uint64_t address = entry.parameter.address.value + step * entry.stride;
  if (address > last_register || draft.read_parameters.size() >= most_parameters) {
    draft.incomplete = true;
    findings.add_once(
        entry.origin.of("n"),
        address > last_register
            ? fmt::format("repetition {} would be at register {}, behind the last", n, address)
            : fmt::format("more than {} parameters", most_parameters));
    return false;
  }
  Parameter parameter = entry.parameter;
  parameter.name = substitute(parameter.name, n);
  parameter.title = substitute(parameter.title, n);
  parameter.address = {static_cast<std::uint16_t>(address)};
  if (step != 0) assign(parameter.evidence, std::optional(entry.repeats));
  add_parameter(std::move(parameter), entry.origin, draft, findings);
  return true;
}

bool add_step(const Template& entry, std::uint64_t step, ProfileDraft& draft,
              Diagnostics& findings) {
  if (entry.repeated) return add_repetition(entry, step, draft, findings);
  if (step == 0) add_parameter(entry.parameter, entry.origin, draft, findings);
  return false;
}

/// The fields of the first repetition, then those of the second: one preset stands together.
void add_entries(const std::vector<Template>& entries, ProfileDraft& draft, Diagnostics& findings) {
  bool any = true;
  for (std::uint64_t step = 0; any; ++step) {
    any = false;
    for (const Template& entry : entries) any |= add_step(entry, step, draft, findings);
  }
}

void read_entry(const YamlNode& node, const YamlNode* group, ProfileDraft& draft,
                std::vector<Template>& entries, Diagnostics& findings) {
  const std::size_t before = findings.told();
  YamlMap map(node, findings, group);
  Origin origin{.entry = &node, .group = group, .layer = draft.layers};
  Template entry = read_template(map, group, origin.overlaps);
  map.finish();
  origin.sound = findings.told() == before;
  entry.origin = origin;
  const std::string_view name = entry.parameter.name;
  const bool repeats = name.find(counter) != std::string::npos;
  if (!origin.sound && (name.empty() || repeats)) draft.incomplete = true;
  if (!name.empty()) entries.push_back(std::move(entry));
}

void read_group(const YamlNode& node, const YamlNode& fields, ProfileDraft& draft,
                Diagnostics& findings) {
  YamlMap group(node, findings);
  for (const std::string_view key :
       {"name",     "n",        "stride",  "table",  "encoding", "scale",    "unit",
        "access",   "evidence", "repeats", "source", "note",     "overlaps", "effect",
        "notation", "range",    "clone",   "secret", "settle",   "hazard",   "fields"}) {
    group.allow(key);
  }
  group.finish();
  if (!expect(fields, YamlNode::Kind::sequence, findings)) draft.incomplete = true;
  std::vector<Template> entries;
  for (const YamlNode& field : fields.items) {
    read_entry(field, &node, draft, entries, findings);
  }
  add_entries(entries, draft, findings);
}

void read_given_value(YamlMap& map, Action& action) {
  if (const YamlNode* labels = map.get("labels")) {
    std::vector<Label> fitting = read_labels(*labels, map.findings());
    std::erase_if(fitting, [&](const Label& label) {
      const bool wrong = label.number < catalogue::lowest(action.kind) ||
                         label.number > catalogue::highest(action.kind);
      if (wrong) {
        map.findings().add(labels->at, fmt::format("{} does not fit {}", label.number,
                                                   catalogue::to_text(action.kind)));
      }
      return wrong;
    });
    action.labels = std::move(fitting);
  }
  if (const auto range = map.range("range", last_register)) {
    action.has_range = true;
    action.minimum = static_cast<std::uint16_t>(range->from);
    action.maximum = static_cast<std::uint16_t>(range->to);
  } else if (!action.labels.empty()) {
    const auto [low, high] =
        std::minmax_element(action.labels.begin(), action.labels.end(),
                            [](const Label& a, const Label& b) { return a.number < b.number; });
    action.minimum = static_cast<std::uint16_t>(low->number);
    action.maximum = static_cast<std::uint16_t>(high->number);
  } else if (!action.value && action.motion == catalogue::Motion::none) {
    map.findings().add(map.node().at, "an action needs a 'value', or a 'range' or 'labels'");
  }
}

/// How an action is carried out beyond one write.
void read_procedure(YamlMap& map, Action& action) {
  assign(action.kind, map.word("encoding", "encoding", catalogue::kind_words));
  assign(action.motion, map.word("motion", "motion", motion_words));
  action.rest = map.number<std::uint16_t>("rest");
  assign(action.busy, map.duration("busy"));
  if (const YamlNode* node = map.get("prepare")) {
    YamlMap preparation(*node, map.findings());
    catalogue::Preparation& prepare = action.prepare.emplace();
    if (auto address = preparation.number<std::uint16_t>("register", Need::required)) {
      prepare.address = {*address};
    }
    assign(prepare.clear, preparation.number<std::uint16_t>("clear", Need::required));
    preparation.finish();
  }
}

Action read_action(YamlMap& map) {
  Action action;
  assign(action.name, map.text("name", Need::required));
  assign(action.title, map.text("title"));
  if (auto address = map.number<std::uint16_t>("register", Need::required)) {
    action.address = {*address};
  }
  action.value = map.number<std::uint16_t>("value");
  action.stop_value = map.number<std::uint16_t>("stop");
  read_procedure(map, action);
  read_given_value(map, action);
  assign(action.hazard, map.word("hazard", "hazard", catalogue::hazard_words, Need::required));
  assign(action.evidence,
         map.word("evidence", "evidence", catalogue::evidence_words, Need::required));
  assign(action.source, map.text("source", Need::required));
  assign(action.note, map.text("note"));
  assign(action.check, map.text("check"));
  assign(action.tells, map.text("tells"));
  if (const YamlNode* effects = map.get("effects")) {
    action.effects = read_labels(*effects, map.findings());
  }
  assign(action.confirm, map.text("confirm"));
  if (const auto confirmed = map.number<std::uint32_t>("confirm-value")) {
    action.confirm_value = *confirmed;
  }
  return action;
}

void add_action(Action action, const Origin& origin, ProfileDraft& draft, Diagnostics& findings) {
  std::vector<Action>& actions = draft.read_actions;
  const auto known = std::find_if(actions.begin(), actions.end(),
                                  [&](const Action& other) { return other.name == action.name; });
  if (known == actions.end()) {
    actions.push_back(std::move(action));
    draft.actions.push_back(origin);
    return;
  }
  Origin& old = draft.actions[static_cast<std::size_t>(known - actions.begin())];
  if (old.layer == origin.layer) {
    findings.add(origin.of("name"), fmt::format("action '{}' is already there", action.name));
  } else {
    *known = std::move(action);
    old = origin;
  }
}

}  // namespace

void read_parameters(const YamlNode& list, ProfileDraft& draft, Diagnostics& findings) {
  if (!expect(list, YamlNode::Kind::sequence, findings)) draft.incomplete = true;
  for (const YamlNode& node : list.items) {
    if (const YamlNode* fields = node.find("fields")) {
      read_group(node, *fields, draft, findings);
    } else {
      std::vector<Template> entries;
      read_entry(node, nullptr, draft, entries, findings);
      add_entries(entries, draft, findings);
    }
  }
}

void read_actions(const YamlNode& list, ProfileDraft& draft, Diagnostics& findings) {
  expect(list, YamlNode::Kind::sequence, findings);
  for (const YamlNode& node : list.items) {
    const std::size_t before = findings.told();
    YamlMap map(node, findings);
    Action action = read_action(map);
    map.finish();
    if (action.name.empty()) continue;
    const bool sound = findings.told() == before;
    add_action(std::move(action), {.entry = &node, .layer = draft.layers, .sound = sound}, draft,
               findings);
  }
}

}  // namespace spindle::files
