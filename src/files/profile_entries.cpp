#include "files/profile_entries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "files/fields.hpp"
#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

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

}  // namespace

template <>
constexpr std::string_view value_name<catalogue::Range> = "range of decimal numbers";

bool read_value(const YamlNode& node, catalogue::Range& target, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::scalar, asked.findings)) return false;
  const auto range = parse_limits(node.text);
  if (range) {
    target = *range;
  } else {
    asked.findings.add(node.at, fmt::format("'{}' is not a range such as 0..6.00", node.text));
  }
  return range.has_value();
}

template <>
constexpr std::string_view value_name<catalogue::List<catalogue::Label>> = "text by number";

bool read_value(const YamlNode& node, catalogue::List<catalogue::Label>& target,
                const Asked& asked) {
  std::vector<catalogue::Label> labels;
  expect(node, YamlNode::Kind::map, asked.findings);
  for (const YamlEntry& entry : node.entries) {
    const auto number = parse_integer(entry.key);
    if (!number) {
      asked.findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
    }
    auto text = to_text(entry.value, asked.findings);
    if (number && text) labels.push_back({*number, std::move(*text)});
  }
  target = std::move(labels);
  return true;
}

namespace {

using catalogue::Action;
using catalogue::Evidence;
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
  std::optional<std::pair<std::uint16_t, std::uint16_t>> numbers = std::nullopt;  ///< of {n}
  std::optional<std::uint16_t> stride = std::nullopt;
  std::optional<Evidence> repeats = std::nullopt;  ///< evidence of all but the first
  bool overlaps = false;
  bool repeated = false;
  Origin origin = {};
};

/// Behind the name of the group, if there is one.
void read_name(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  const auto text = to_text(node, asked.findings);
  if (!text) return;
  parameter.name = parameter.name.to_string() + *text;
  if (parameter.name.empty()) asked.findings.add(node.at, "key 'name' is empty");
}

void read_except(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  catalogue::Range except;
  if (!read_value(node, except, asked)) return;
  if (except.minimum && except.maximum) {
    parameter.except = except;
  } else {
    asked.findings.add(node.at, "a hole in a range has two ends");
  }
}

std::vector<catalogue::BitName> to_bit_names(const YamlNode& node, std::optional<std::int64_t> when,
                                             Diagnostics& findings) {
  constexpr std::uint64_t highest_bit = 31;
  expect(node, YamlNode::Kind::map, findings);
  std::vector<catalogue::BitName> bits;
  for (const YamlEntry& entry : node.entries) {
    const auto bit = parse_unsigned(entry.key, highest_bit);
    if (!bit) {
      findings.add(entry.key_at,
                   fmt::format("'{}' is not a bit from 0 to {}", entry.key, highest_bit));
    }
    auto text = to_text(entry.value, findings);
    if (bit && text) bits.push_back({static_cast<std::uint8_t>(*bit), std::move(*text), when});
  }
  return bits;
}

void add_bits(Parameter& parameter, std::vector<catalogue::BitName> more) {
  more.insert(more.begin(), parameter.bits.begin(), parameter.bits.end());
  parameter.bits = std::move(more);
}

void read_bits(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  add_bits(parameter, to_bit_names(node, std::nullopt, asked.findings));
}

/// {0: {3: FWD}, 1: {3: START/STOP}}
void read_names_of_bits(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::map, asked.findings)) return;
  for (const YamlEntry& entry : node.entries) {
    if (const auto value = parse_integer(entry.key)) {
      add_bits(parameter, to_bit_names(entry.value, *value, asked.findings));
    } else {
      asked.findings.add(entry.key_at, fmt::format("'{}' is not a whole number", entry.key));
    }
  }
}

constexpr Field<Parameter> bits_by_fields[] = {
    field<&Parameter::bits_by>("parameter", Need::required),
    custom("names", Need::required, "names of bits by number", read_names_of_bits),
};

void read_scale(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  Decimal scale;
  if (!read_value(node, scale, asked)) return;
  if (scale > Decimal(0)) {
    parameter.encoding.scale = scale;
  } else {
    asked.findings.add(asked.map.at, "scale must be above zero");
  }
}

/// As documents print it; "torque" stands for the torque unit that is set on the tool.
void read_unit(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  auto unit = to_text(node, asked.findings);
  if (!unit) return;
  const bool is_word = std::none_of(unit->begin(), unit->end(),
                                    [](unsigned char c) { return c <= ' ' || c == 0x7F; });
  if (is_word && unit->size() <= longest_unit) {
    parameter.unit = std::move(*unit);
  } else {
    asked.findings.add(node.at,
                       fmt::format("a unit is one word of at most {} bytes", longest_unit));
  }
}

void read_secret(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  bool secret = false;
  read_value(node, secret, asked);
  if (secret) parameter.secrecy = catalogue::Secrecy::secret;
}

constexpr Field<Parameter> parameter_fields[] = {
    custom("name", Need::required, "text", read_name),
    field<&Parameter::title>("title", Need::required),
    word<modbus::table_words, &Parameter::table>("table").shared(),
    field<&Parameter::address>("register", Need::required),
    word<catalogue::kind_words, &Parameter::encoding, &catalogue::Encoding::kind>("encoding",
                                                                                  Need::required)
        .shared(),
    custom("scale", Need::optional, "decimal number", read_scale).shared(),
    custom("unit", Need::optional, "text", read_unit).shared(),
    field<&Parameter::range>("range").shared(),
    custom("except", Need::optional, "range of decimal numbers", read_except),
    field<&Parameter::default_value>("default"),
    field<&Parameter::labels>("labels"),
    custom("bits", Need::optional, "text by number", read_bits),
    map_here<bits_by_fields>("bits-by"),
    word<notation_words, &Parameter::notation>("notation").shared(),
    word<catalogue::effect_words, &Parameter::effect>("effect").shared(),
    field<&Parameter::risk>("risk"),
    field<&Parameter::settle>("settle").shared(),
    word<catalogue::hazard_words, &Parameter::hazard>("hazard").shared(),
    word<catalogue::access_words, &Parameter::access>("access", Need::required).shared(),
    word<reading_words, &Parameter::reading>("reading"),
    word<catalogue::evidence_words, &Parameter::evidence>("evidence", Need::required).shared(),
    field<&Parameter::source>("source", Need::required).shared(),
    field<&Parameter::note>("note").shared(),
    word<clone_words, &Parameter::cloning>("clone", Need::optional, "value of clone").shared(),
    custom("secret", Need::optional, "true | false", read_secret).shared(),
};

constexpr Field<Template> template_fields[] = {
    field<&Template::overlaps>("overlaps").shared(),
    field<&Template::numbers>("n").shared(),
    field<&Template::stride>("stride").shared(),
    word<catalogue::evidence_words, &Template::repeats>("repeats", Need::optional, "evidence")
        .shared(),
};

void check_repetition(YamlMap& map, Template& entry) {
  const bool has_counter = entry.parameter.name.view().find(counter) != std::string_view::npos;
  const bool has_range = map.find("n", true) != nullptr;
  if (has_counter != has_range) {
    map.findings().add(map.node().at, has_counter ? "the name has {n}, but key 'n' is missing"
                                                  : "key 'n' is given, but the name has no {n}");
    return;
  }
  if (!entry.numbers) return;
  entry.repeated = entry.stride.value_or(0) != 0;
  if (!entry.repeated) map.findings().add(map.node().at, "key 'n' needs a 'stride' above zero");
}

Template read_template(YamlMap& map, const YamlNode* group) {
  Template entry;
  const YamlNode* prefix = group == nullptr ? nullptr : group->find("name");
  if (prefix != nullptr && map.node().find("name") != nullptr) entry.parameter.name = prefix->text;
  read_fields(parameter_fields, map, entry.parameter);
  read_fields(template_fields, map, entry);
  check_repetition(map, entry);
  map.finish();
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
  const std::uint64_t n = entry.numbers->first + step;
  if (n > entry.numbers->second) return false;
  const std::uint64_t address = entry.parameter.address.value + step * *entry.stride;
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
  if (step != 0 && entry.repeats) parameter.evidence = *entry.repeats;
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
  Template entry = read_template(map, group);
  Origin origin{.entry = &node, .group = group, .layer = draft.layers, .overlaps = entry.overlaps};
  origin.sound = findings.told() == before;
  entry.origin = origin;
  const std::string_view name = entry.parameter.name;
  const bool repeats = name.find(counter) != std::string::npos;
  if (!origin.sound && (name.empty() || repeats)) draft.incomplete = true;
  if (!name.empty()) entries.push_back(std::move(entry));
}

/// What a group may say for all its fields.
std::vector<Key> group_keys() {
  std::vector<Key> keys = {{.name = "name", .value = "text"}};
  for (const Key& key : parameter_keys()) {
    if (key.shared) keys.push_back(key);
  }
  keys.push_back({.name = "fields", .need = Need::required, .value = "list of maps"});
  return keys;
}

void read_group(const YamlNode& node, const YamlNode& fields, ProfileDraft& draft,
                Diagnostics& findings) {
  YamlMap group(node, findings);
  for (const Key& key : group_keys()) group.know(key.name);
  group.finish();
  if (!expect(fields, YamlNode::Kind::sequence, findings)) draft.incomplete = true;
  std::vector<Template> entries;
  for (const YamlNode& field : fields.items) {
    read_entry(field, &node, draft, entries, findings);
  }
  add_entries(entries, draft, findings);
}

void read_action_range(const YamlNode& node, Action& action, const Asked& asked) {
  std::pair<std::uint16_t, std::uint16_t> range;
  action.has_range = read_value(node, range, asked);
  if (action.has_range) std::tie(action.minimum, action.maximum) = range;
}

constexpr Field<catalogue::Preparation> preparation_fields[] = {
    field<&catalogue::Preparation::address>("register", Need::required),
    field<&catalogue::Preparation::clear>("clear", Need::required),
};

constexpr Field<Action> action_fields[] = {
    field<&Action::name>("name", Need::required),
    field<&Action::title>("title"),
    field<&Action::address>("register", Need::required),
    field<&Action::value>("value"),
    field<&Action::stop_value>("stop"),
    word<catalogue::kind_words, &Action::kind>("encoding"),
    word<motion_words, &Action::motion>("motion"),
    field<&Action::rest>("rest"),
    field<&Action::busy>("busy"),
    map_of<preparation_fields, &Action::prepare>("prepare"),
    field<&Action::labels>("labels"),
    custom("range", Need::optional, "range 0..65535", read_action_range),
    word<catalogue::hazard_words, &Action::hazard>("hazard", Need::required),
    word<catalogue::evidence_words, &Action::evidence>("evidence", Need::required),
    field<&Action::source>("source", Need::required),
    field<&Action::note>("note"),
    field<&Action::check>("check"),
    field<&Action::tells>("tells"),
    field<&Action::effects>("effects"),
    field<&Action::confirm>("confirm"),
    field_as<std::uint32_t, &Action::confirm_value>("confirm-value"),
};

/// Leaves out labels that the encoding has no number for.
void check_labels(const YamlNode& node, Action& action, Diagnostics& findings) {
  std::vector<Label> fitting;
  for (const Label& label : action.labels) {
    if (label.number >= catalogue::lowest(action.kind) &&
        label.number <= catalogue::highest(action.kind)) {
      fitting.push_back(label);
    } else {
      findings.add(node.find("labels")->at, fmt::format("{} does not fit {}", label.number,
                                                        catalogue::to_text(action.kind)));
    }
  }
  if (fitting.size() != action.labels.size()) action.labels = std::move(fitting);
}

/// Without a range of its own a value is one of the labels.
void find_range(const YamlNode& node, Action& action, Diagnostics& findings) {
  if (action.has_range) return;
  if (!action.labels.empty()) {
    const auto [low, high] =
        std::minmax_element(action.labels.begin(), action.labels.end(),
                            [](const Label& a, const Label& b) { return a.number < b.number; });
    action.minimum = static_cast<std::uint16_t>(low->number);
    action.maximum = static_cast<std::uint16_t>(high->number);
  } else if (!action.value && action.motion == catalogue::Motion::none) {
    findings.add(node.at, "an action needs a 'value', or a 'range' or 'labels'");
  }
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

std::vector<Key> parameter_keys() { return keys_of<parameter_fields, template_fields>(); }
std::vector<Key> action_keys() { return keys_of<action_fields>(); }

void read_parameters(const YamlNode& list, ProfileDraft& draft, const Asked& asked) {
  Diagnostics& findings = asked.findings;
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

void read_actions(const YamlNode& list, ProfileDraft& draft, const Asked& asked) {
  Diagnostics& findings = asked.findings;
  expect(list, YamlNode::Kind::sequence, findings);
  for (const YamlNode& node : list.items) {
    const std::size_t before = findings.told();
    Action action;
    read_map(action_fields, node, action, findings);
    check_labels(node, action, findings);
    find_range(node, action, findings);
    if (action.name.empty()) continue;
    const bool sound = findings.told() == before;
    add_action(std::move(action), {.entry = &node, .layer = draft.layers, .sound = sound}, draft,
               findings);
  }
}

}  // namespace spindle::files
