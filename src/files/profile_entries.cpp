#include "files/profile_entries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "files/fields.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/document_number.hpp"

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
constexpr std::size_t longest_unit = 24;

constexpr auto clone_words = enum_table<catalogue::Cloning>(
    {{"never", catalogue::Cloning::never}, {"allowed", catalogue::Cloning::allowed}});

constexpr auto reading_words = enum_table<catalogue::Reading>(
    {{"harmless", catalogue::Reading::harmless}, {"consumes", catalogue::Reading::consumes}});

constexpr auto notation_words = enum_table<catalogue::Notation>(
    {{"decimal", catalogue::Notation::decimal}, {"hex", catalogue::Notation::hexadecimal}});

constexpr std::uint8_t bits_per_byte = 8;
enum class Half : std::uint8_t { low, high };
constexpr auto half_words = enum_table<Half>({{"low", Half::low}, {"high", Half::high}});

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

constexpr std::uint64_t highest_bit = 63;

/// "3", or "4..7" for bits that are one number.
std::optional<catalogue::BitSlice> parse_slice(std::string_view text) {
  const std::size_t dots = text.find("..");
  const auto first = parse_unsigned(text.substr(0, dots), highest_bit);
  const auto last =
      dots == std::string_view::npos ? first : parse_unsigned(text.substr(dots + 2), highest_bit);
  if (!first || !last || *last < *first) return std::nullopt;
  return catalogue::BitSlice{static_cast<std::uint8_t>(*first),
                             static_cast<std::uint8_t>(*last - *first + 1)};
}

std::vector<catalogue::BitName> to_bit_names(const YamlNode& node, std::optional<std::int64_t> when,
                                             Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<catalogue::BitName> bits;
  for (const YamlEntry& entry : node.entries) {
    const auto slice = parse_slice(entry.key);
    if (!slice) {
      findings.add(entry.key_at,
                   fmt::format("'{}' is not a bit from 0 to {}", entry.key, highest_bit));
    }
    auto text = to_text(entry.value, findings);
    if (slice && text) bits.push_back({slice->first, std::move(*text), when, slice->width});
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

/// "0.01" or "20/32768".
void read_scale(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  const std::size_t slash = node.text.find('/');
  if (node.kind == YamlNode::Kind::scalar && slash != std::string::npos) {
    const auto scale = Decimal::parse(std::string_view(node.text).substr(0, slash));
    const auto divisor = parse_unsigned(std::string_view(node.text).substr(slash + 1),
                                        std::numeric_limits<std::uint32_t>::max());
    if (!scale || *scale <= Decimal(0) || !divisor || *divisor == 0) {
      asked.findings.add(node.at, fmt::format("'{}' is no fraction such as 20/32768", node.text));
      return;
    }
    parameter.encoding.scale = *scale;
    parameter.encoding.divisor = static_cast<std::uint32_t>(*divisor);
    return;
  }
  Decimal scale;
  if (!read_value(node, scale, asked)) return;
  if (scale != Decimal(0)) {
    parameter.encoding.scale = scale;
  } else {
    asked.findings.add(asked.map.at, "scale must not be zero");
  }
}

void read_slice(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  const auto text = to_text(node, asked.findings);
  if (!text) return;
  if (const auto slice = parse_slice(*text)) {
    parameter.encoding.slice = *slice;
  } else {
    asked.findings.add(node.at, fmt::format("'{}' is not a bit, nor bits such as 4..7", node.text));
  }
}

void read_half(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  Half half = Half::low;
  read_word(half_words, node, half, asked);
  const std::uint8_t first = half == Half::high ? bits_per_byte : 0;
  parameter.encoding.slice = {first, bits_per_byte};
}

/// Patterns are told when the encoding is known; see set_nulls().
void read_nulls(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  const auto add = [&](const YamlNode& item) {
    const auto text = to_text(item, asked.findings);
    if (!text) return;
    const bool is_negative = text->starts_with('-');
    const auto number = parse_unsigned(std::string_view(*text).substr(is_negative ? 1 : 0),
                                       std::numeric_limits<std::uint64_t>::max());
    if (!number) {
      asked.findings.add(item.at, fmt::format("'{}' is not a whole number", *text));
      return;
    }
    std::vector<std::uint64_t> nulls(parameter.nulls.begin(), parameter.nulls.end());
    nulls.push_back(is_negative ? 0U - *number : *number);
    parameter.nulls = std::move(nulls);
  };
  if (node.kind != YamlNode::Kind::sequence) return add(node);
  for (const YamlNode& item : node.items) add(item);
}

/// One name or pattern, or a list of them.
template <catalogue::List<catalogue::Text> Parameter::*member>
void read_patterns(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  if (node.kind == YamlNode::Kind::sequence) {
    read_value(node, parameter.*member, asked);
    return;
  }
  catalogue::Text one;
  if (read_value(node, one, asked)) parameter.*member = {one};
}

/// As documents print it; "torque" stands for the torque unit that is set on the tool.
void read_unit(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  auto unit = to_text(node, asked.findings);
  if (!unit) return;
  const bool is_clean = std::none_of(unit->begin(), unit->end(),
                                     [](unsigned char c) { return c < ' ' || c == 0x7F; }) &&
                        !unit->starts_with(' ') && !unit->ends_with(' ');
  if (is_clean && unit->size() <= longest_unit) {
    parameter.unit = std::move(*unit);
  } else {
    asked.findings.add(node.at, fmt::format("a unit is a text of at most {} bytes", longest_unit));
  }
}

void read_secret(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  bool secret = false;
  read_value(node, secret, asked);
  if (secret) parameter.secrecy = catalogue::Secrecy::secret;
}

void read_guarded(const YamlNode& node, Parameter& parameter, const Asked& asked) {
  bool guarded = false;
  read_value(node, guarded, asked);
  if (guarded) parameter.guarding = catalogue::Guarding::alone;
}

constexpr Field<Parameter> parameter_fields[] = {
    custom("name", Need::required, "text", read_name),
    field<&Parameter::title>("title", Need::required),
    word<modbus::table_words, &Parameter::table>("table").shared(),
    field<&Parameter::address>("register", Need::required),
    word<catalogue::kind_words, &Parameter::encoding, &catalogue::Encoding::kind>("encoding",
                                                                                  Need::required)
        .shared(),
    custom("scale", Need::optional, "decimal number, or a fraction", read_scale).shared(),
    field<&Parameter::scale_by>("scale-from").shared(),
    field<&Parameter::encoding, &catalogue::Encoding::offset>("offset").shared(),
    field<&Parameter::encoding, &catalogue::Encoding::decimals>("decimals").shared(),
    field<&Parameter::encoding, &catalogue::Encoding::length>("length").shared(),
    field<&Parameter::encoding, &catalogue::Encoding::count>("count").shared(),
    custom("bit", Need::optional, "bit, or bits such as 4..7", read_slice),
    custom("half", Need::optional, "low | high", read_half),
    word<catalogue::word_order_words, &Parameter::encoding, &catalogue::Encoding::word_order>(
        "word-order")
        .shared(),
    word<catalogue::byte_order_words, &Parameter::encoding, &catalogue::Encoding::byte_order>(
        "byte-order")
        .shared(),
    word<catalogue::padding_words, &Parameter::encoding, &catalogue::Encoding::padding>("padding")
        .shared(),
    word<catalogue::packing_words, &Parameter::encoding, &catalogue::Encoding::packing>("packing")
        .shared(),
    word<catalogue::date_layout_words, &Parameter::encoding, &catalogue::Encoding::date>("date")
        .shared(),
    custom("null", Need::optional, "number, or list of numbers", read_nulls).shared(),
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
    field<&Parameter::write_address>("write-register"),
    custom("before", Need::optional, "name or pattern, or list of them",
           read_patterns<&Parameter::before>)
        .shared(),
    custom("after", Need::optional, "name or pattern, or list of them",
           read_patterns<&Parameter::after>)
        .shared(),
    word<catalogue::access_words, &Parameter::access>("access", Need::required).shared(),
    word<reading_words, &Parameter::reading>("reading"),
    word<catalogue::evidence_words, &Parameter::evidence>("evidence", Need::required).shared(),
    field<&Parameter::source>("source", Need::required).shared(),
    field<&Parameter::note>("note").shared(),
    word<clone_words, &Parameter::cloning>("clone", Need::optional, "value of clone").shared(),
    custom("secret", Need::optional, "true | false", read_secret).shared(),
    custom("guarded", Need::optional, "true | false", read_guarded).shared(),
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

/// Whether a number can stand there: as the bits of an unsigned integer, or negative.
bool fits(const catalogue::Encoding& encoding, std::uint64_t number) {
  const auto bits =
      16U * catalogue::register_count(encoding) / std::max<unsigned>(encoding.count, 1);
  const unsigned width = encoding.is_part() ? encoding.slice.width : bits;
  if (width >= 64 || number >> width == 0) return true;
  const Decimal negative(static_cast<std::int64_t>(number));
  if (negative.sign() == Sign::plus) return false;
  return encoding.is_float() || negative >= catalogue::lowest(encoding);
}

/// Bits that are the value's, of what was written down as a number. Of a floating-point number it
/// may be the number itself.
void set_nulls(Parameter& parameter, const YamlNode& node, Diagnostics& findings) {
  if (!parameter.encoding.is_integer() && !parameter.encoding.is_float()) return;
  std::vector<std::uint64_t> nulls;
  for (const std::uint64_t number : parameter.nulls) {
    if (!fits(parameter.encoding, number)) {
      const auto written = static_cast<std::int64_t>(number);
      findings.add(node.at,
                   fmt::format("{}: null {} does not fit {}", parameter.name,
                               written < 0 ? std::to_string(written) : std::to_string(number),
                               catalogue::to_text(parameter.encoding.kind)));
      continue;
    }
    if (parameter.encoding.is_float()) {
      nulls.push_back(number);
      continue;
    }
    const std::uint64_t pattern =
        catalogue::to_pattern(parameter.encoding, catalogue::Integer{Sign::plus, number});
    nulls.push_back(pattern);
  }
  parameter.nulls = std::move(nulls);
}

/// What an encoding means without being told.
void complete(Parameter& parameter, const YamlMap& map) {
  catalogue::Encoding& encoding = parameter.encoding;
  const bool is_half = encoding.kind == catalogue::Kind::u8 || encoding.kind == catalogue::Kind::i8;
  if (is_half && encoding.slice.is_whole()) encoding.slice = {0, bits_per_byte};
  if (encoding.kind == catalogue::Kind::bcd && encoding.length == 0) encoding.length = 2;
  const YamlNode* null = map.find("null", true);
  if (null != nullptr && !parameter.nulls.empty()) set_nulls(parameter, *null, map.findings());
}

Template read_template(YamlMap& map, const YamlNode* group, const ProfileDraft& draft) {
  Template entry;
  entry.parameter.encoding.word_order = draft.profile.link.word_order;
  entry.parameter.encoding.byte_order = draft.profile.link.byte_order;
  const YamlNode* prefix = group == nullptr ? nullptr : group->find("name");
  if (prefix != nullptr && map.node().find("name") != nullptr) entry.parameter.name = prefix->text;
  read_fields(parameter_fields, map, entry.parameter);
  read_fields(template_fields, map, entry);
  complete(entry.parameter, map);
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
  YamlMap map(node, findings, group, draft.top.entry);
  Template entry = read_template(map, group, draft);
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
    word<modbus::table_words, &Action::table>("table"),
    field<&Action::address>("register", Need::required),
    field<&Action::value>("value"),
    field<&Action::stop_value>("stop"),
    word<catalogue::kind_words, &Action::encoding, &catalogue::Encoding::kind>("encoding"),
    word<motion_words, &Action::motion>("motion"),
    field<&Action::rest>("rest"),
    field<&Action::busy>("busy"),
    map_of<preparation_fields, &Action::prepare>("prepare"),
    field<&Action::labels>("labels"),
    custom("range", Need::optional, "range 0..65535", read_action_range),
    word<catalogue::hazard_words, &Action::hazard>("hazard", Need::required),
    word<catalogue::evidence_words, &Action::evidence>("evidence", Need::required).shared(),
    field<&Action::source>("source", Need::required).shared(),
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
    if (Decimal(label.number) >= catalogue::lowest(action.encoding) &&
        Decimal(label.number) <= catalogue::highest(action.encoding)) {
      fitting.push_back(label);
    } else {
      findings.add(node.find("labels")->at, fmt::format("{} does not fit {}", label.number,
                                                        catalogue::to_text(action.encoding.kind)));
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

/// 40001 is holding register 0: the numbers of older documents say the table, and count from 1.
void renumber(YamlNode& entry, Diagnostics& findings) {
  for (YamlEntry& key : entry.entries) {
    if (key.key != "fields") continue;
    for (YamlNode& field : key.value.items) renumber(field, findings);
  }
  const auto at = std::find_if(entry.entries.begin(), entry.entries.end(),
                               [](const YamlEntry& key) { return key.key == "register"; });
  if (at == entry.entries.end()) return;
  const auto meant = catalogue::parse_document_number(at->value.text);
  if (!meant) {
    findings.add(at->value.at, fmt::format("'{}' is no number such as 40001, which 'numbering: "
                                           "modicon' promises",
                                           at->value.text));
    return;
  }
  at->value.text = std::to_string(meant->address.value);
  if (entry.find("table") != nullptr) {
    findings.add(at->value.at, "the number says the table, so 'table' has to be left out");
    return;
  }
  YamlEntry table = *at;
  table.key = "table";
  table.value.text = modbus::to_text(meant->table);
  entry.entries.push_back(std::move(table));
}

}  // namespace

std::vector<Key> parameter_keys() { return keys_of<parameter_fields, template_fields>(); }
std::vector<Key> action_keys() { return keys_of<action_fields>(); }

void read_parameters(const YamlNode& written, ProfileDraft& draft, const Asked& asked) {
  Diagnostics& findings = asked.findings;
  if (!expect(written, YamlNode::Kind::sequence, findings)) draft.incomplete = true;
  if (draft.numbering == Numbering::modicon) {
    draft.renumbered.push_back(std::make_unique<YamlNode>(written));
    for (YamlNode& node : draft.renumbered.back()->items) renumber(node, findings);
  }
  const YamlNode& list = draft.numbering == Numbering::modicon ? *draft.renumbered.back() : written;
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

/// Their registers are none of the product's, so they stand apart from its parameters.
void read_event_fields(const YamlNode& written, ProfileDraft& draft, const Asked& asked) {
  ProfileDraft apart;
  apart.profile.link = draft.profile.link;
  apart.top = draft.top;
  apart.layers = draft.layers;
  apart.read_parameters = std::move(draft.event_fields);
  const Origin base = {.entry = &written, .layer = draft.layers == 0 ? 0 : draft.layers - 1};
  apart.parameters.assign(apart.read_parameters.size(), base);
  for (std::size_t i = 0; i < apart.read_parameters.size(); ++i) {
    apart.parameter_index.emplace(apart.read_parameters[i].name, i);
  }
  read_parameters(written, apart, asked);
  draft.incomplete = draft.incomplete || apart.incomplete;
  for (std::size_t i = 0; i < apart.read_parameters.size(); ++i) {
    if (apart.parameters[i].sound) {
      draft.event_fields.push_back(std::move(apart.read_parameters[i]));
    } else {
      draft.half_read.insert(apart.read_parameters[i].name);
    }
  }
}

void read_actions(const YamlNode& written, ProfileDraft& draft, const Asked& asked) {
  Diagnostics& findings = asked.findings;
  expect(written, YamlNode::Kind::sequence, findings);
  if (draft.numbering == Numbering::modicon) {
    draft.renumbered.push_back(std::make_unique<YamlNode>(written));
    for (YamlNode& node : draft.renumbered.back()->items) renumber(node, findings);
  }
  const YamlNode& list = draft.numbering == Numbering::modicon ? *draft.renumbered.back() : written;
  for (const YamlNode& node : list.items) {
    const std::size_t before = findings.told();
    Action action;
    action.encoding.word_order = draft.profile.link.word_order;
    action.encoding.byte_order = draft.profile.link.byte_order;
    YamlMap map(node, findings, nullptr, draft.top.entry);
    read_fields(action_fields, map, action);
    map.finish();
    check_labels(node, action, findings);
    find_range(node, action, findings);
    if (action.name.empty()) continue;
    const bool sound = findings.told() == before;
    add_action(std::move(action), {.entry = &node, .layer = draft.layers, .sound = sound}, draft,
               findings);
  }
}

}  // namespace spindle::files
