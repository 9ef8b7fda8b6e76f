#include "files/profile_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "files/profile_drive.hpp"
#include "files/profile_entries.hpp"
#include "files/profile_run.hpp"
#include "files/yaml_map.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/profile_store.hpp"

namespace spindle::files {
namespace {

using catalogue::Area;
using catalogue::CodeText;
using catalogue::Evidence;

constexpr std::uint64_t last_register = std::numeric_limits<std::uint16_t>::max();
constexpr std::uint64_t last_byte = std::numeric_limits<std::uint8_t>::max();

constexpr auto framing_words =
    enum_table<modbus::Framing>({{"tcp", modbus::Framing::tcp}, {"rtu", modbus::Framing::rtu}});
constexpr auto pair_words = enum_table<bool>({{"even", true}, {"any", false}});
/// A tool that does not copy the transaction id cannot be told from its own pushed frames.
constexpr auto transaction_words = enum_table<bool>({{"echoed", true}, {"", false}});

Need need_of(bool inherited) { return inherited ? Need::optional : Need::required; }

// ---- register areas ----

std::optional<Area> read_area(const YamlNode& node, modbus::RegisterTable table,
                              Diagnostics& findings) {
  Area area{.table = table};
  std::optional<NumberRange> range;
  if (node.kind == YamlNode::Kind::map) {
    YamlMap map(node, findings);
    range = map.range("at", last_register, Need::required);
    assign(area.note, map.text("note"));
    map.finish();
  } else {
    range = to_range(node, last_register, findings);
  }
  if (!range) return std::nullopt;
  area.from = static_cast<std::uint16_t>(range->from);
  area.to = static_cast<std::uint16_t>(range->to);
  return area;
}

/// {holding: [1..725, {at: 564..568, note: "..."}], input: [...]}
std::optional<std::vector<Area>> read_areas(const YamlNode* node, Diagnostics& findings) {
  if (node == nullptr) return std::nullopt;
  YamlMap map(*node, findings);
  std::vector<Area> areas;
  for (const auto& [name, table] : modbus::table_words) {
    const YamlNode* list = map.get(name);
    if (list == nullptr || !expect(*list, YamlNode::Kind::sequence, findings)) continue;
    for (const YamlNode& item : list->items) {
      if (auto area = read_area(item, table, findings)) areas.push_back(std::move(*area));
    }
  }
  map.finish();
  return areas;
}

// ---- link ----

std::optional<std::vector<catalogue::GapRule>> read_gaps(const YamlNode* node,
                                                         Diagnostics& findings) {
  if (node == nullptr || !expect(*node, YamlNode::Kind::sequence, findings)) return std::nullopt;
  std::vector<catalogue::GapRule> gaps;
  for (const YamlNode& item : node->items) {
    YamlMap map(item, findings);
    catalogue::GapRule rule;
    assign(rule.up_to_baud, map.number<unsigned>("up-to"));
    map.get("gap", Need::required);
    assign(rule.gap, map.duration("gap"));
    map.finish();
    gaps.push_back(rule);
  }
  return gaps;
}

void read_serial(const YamlNode& node, catalogue::SerialSpec& serial, Diagnostics& findings) {
  YamlMap map(node, findings);
  assign(serial.line.baud, map.number<unsigned>("baud"));
  assign(serial.line.parity, map.word("parity", "parity", modbus::parity_words));
  assign(serial.line.stop_bits, map.number<unsigned>("stop"));
  assign(serial.gaps, read_gaps(map.get("gaps"), findings));
  assign(serial.broadcast_pause, map.duration("broadcast-pause"));
  map.finish();
}

void read_link(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(node, findings);
  catalogue::LinkSpec& link = draft.profile.link;
  assign(link.framing, map.word("framing", "framing", framing_words,
                                need_of(draft.link.entry != nullptr || draft.incomplete)));
  assign(link.port, map.number<std::uint16_t>("port"));
  assign(link.unit, map.number<std::uint8_t>("unit"));
  if (const auto units = map.range("units", last_byte)) {
    link.units = {static_cast<std::uint8_t>(units->from), static_cast<std::uint8_t>(units->to)};
  }
  map.word("transaction", "transaction", transaction_words);
  assign(link.max_read, map.number<std::uint16_t>("max-read"));
  assign(link.max_write, map.number<std::uint16_t>("max-write"));
  assign(link.keep_alive, map.duration("keep-alive"));
  assign(link.answer, map.duration("answer"));
  assign(link.connect, map.duration("connect"));
  assign(link.retries, map.number<unsigned>("retries"));
  assign(link.settle, map.duration("settle"));
  assign(link.loopback, map.flag("loopback"));
  assign(link.any_unit, map.flag("any-unit"));
  assign(link.even_pairs, map.word("pairs", "pairs", pair_words));
  if (const YamlNode* serial = map.get("serial")) read_serial(*serial, link.serial, findings);
  assign(link.contiguous, read_areas(map.get("contiguous"), findings));
  assign(link.absent, read_areas(map.get("absent"), findings));
  map.finish();
}

// ---- identity ----

template <typename Number>
void read_names(const YamlNode* node, catalogue::Table<Number, catalogue::Text>& table,
                Diagnostics& findings) {
  if (node == nullptr) return;
  std::map<Number, catalogue::Text> names = table.to_map();
  expect(*node, YamlNode::Kind::map, findings);
  for (const YamlEntry& entry : node->entries) {
    const auto number = parse_unsigned(entry.key, last_register);
    if (!number) {
      findings.add(entry.key_at,
                   fmt::format("'{}' is not a number up to {}", entry.key, last_register));
    }
    auto text = to_text(entry.value, findings);
    if (number && text) names.insert_or_assign(static_cast<Number>(*number), std::move(*text));
  }
  table = std::move(names);
}

std::optional<catalogue::Slice> read_slice(YamlMap& map, std::string_view key,
                                           Need need = Need::optional) {
  const auto range = map.range(key, last_byte, need);
  if (!range) return std::nullopt;
  return catalogue::Slice{static_cast<std::uint8_t>(range->from),
                          static_cast<std::uint8_t>(range->to - range->from + 1)};
}

void read_long_serial(const YamlNode& node, catalogue::IdentitySpec& identity,
                      Diagnostics& findings) {
  YamlMap map(node, findings);
  const Need need = need_of(identity.long_serial_bytes != 0);
  assign(identity.long_serial_bytes, map.number<std::uint8_t>("from-bytes", need));
  assign(identity.long_serial, read_slice(map, "at", need));
  assign(identity.product_byte, map.number<std::uint8_t>("product-at"));
  read_names(map.get("products"), identity.products, findings);
  map.finish();
}

void read_total(const YamlNode& node, catalogue::IdentitySpec& identity, Diagnostics& findings) {
  YamlMap map(node, findings);
  const Need need = need_of(identity.total_bytes != 0);
  assign(identity.total_bytes, map.number<std::uint8_t>("from-bytes", need));
  assign(identity.total, read_slice(map, "at", need));
  map.finish();
}

void read_identity(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(node, findings);
  auto [identity, need] = section_of(draft.profile.identity);
  assign(identity.minimum_bytes, map.number<std::uint8_t>("minimum-bytes", need));
  assign(identity.id, read_slice(map, "id"));
  assign(identity.controller_model, read_slice(map, "controller-model"));
  assign(identity.tool_model, read_slice(map, "tool-model", need));
  assign(identity.firmware, read_slice(map, "firmware", need));
  assign(identity.serial, read_slice(map, "serial", need));
  if (const YamlNode* part = map.get("long-serial")) read_long_serial(*part, identity, findings);
  if (const YamlNode* part = map.get("total")) read_total(*part, identity, findings);
  read_names(map.get("models", need), identity.models, findings);
  assign(identity.firmware_below, map.number<unsigned>("firmware-below"));
  map.finish();
}

// ---- events, limits, numbered ----

constexpr auto source_words =
    enum_table<catalogue::EventModel>({{"push", catalogue::EventModel::push},
                                       {"counter", catalogue::EventModel::counter},
                                       {"flag", catalogue::EventModel::flag}});

void read_arm(const YamlNode& node, catalogue::EventSpec& events, Diagnostics& findings) {
  YamlMap map(node, findings);
  auto [arm, need] = section_of(events.arm);
  assign(arm.address, map.number<std::uint16_t>("register", need));
  assign(arm.value, map.number<std::uint16_t>("value"));
  assign(arm.disarm, map.number<std::uint16_t>("disarm"));
  assign(arm.every, map.duration("every"));
  assign(arm.expires, map.duration("expires"));
  map.finish();
}

std::optional<catalogue::EventKind> to_kind(const std::string& name, Position at,
                                            Diagnostics& findings) {
  const auto kind = catalogue::event_kind_words.find(name);
  if (!kind) {
    findings.add_once(at, unknown_word("event kind", name, catalogue::event_kind_words.words()));
  }
  return kind;
}

void read_kinds(const YamlNode* node, catalogue::EventSpec& events, Diagnostics& findings) {
  catalogue::Table<std::int64_t, catalogue::Text> names;
  read_names(node, names, findings);
  std::map<std::int64_t, catalogue::EventKind> kinds = events.kinds.to_map();
  for (const auto& [number, name] : names) {
    const auto kind = to_kind(name, node->at, findings);
    if (kind) kinds.insert_or_assign(number, *kind);
  }
  events.kinds = std::move(kinds);
}

void read_columns(const YamlNode& node, catalogue::EventSpec& events, Diagnostics& findings) {
  expect(node, YamlNode::Kind::sequence, findings);
  std::vector<catalogue::EventColumn> columns;
  for (const YamlNode& item : node.items) {
    YamlMap map(item, findings);
    catalogue::EventColumn column;
    assign(column.heading, map.text("heading", Need::required));
    assign(column.parameter, map.text("parameter", Need::required));
    assign(column.width, map.number<std::uint8_t>("width"));
    map.finish();
    columns.push_back(std::move(column));
  }
  events.columns = std::move(columns);
}

void read_events(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(node, findings);
  auto [events, need] = section_of(draft.profile.events);
  assign(events.model, map.word("source", "source of events", source_words));
  if (const YamlNode* arm = map.get("arm")) read_arm(*arm, events, findings);
  assign(events.function, map.number<std::uint8_t>("function", need));
  assign(events.first, map.number<std::uint16_t>("first", need));
  assign(events.count, map.number<std::uint16_t>("count", need));
  assign(events.number, map.text("number"));
  assign(events.flag, map.text("flag"));
  assign(events.kind, map.text("kind", need));
  read_kinds(map.get("kinds"), events, findings);
  assign(events.error, map.text("error"));
  if (const YamlNode* columns = map.get("columns")) read_columns(*columns, events, findings);
  if (auto interval = map.duration("interval")) events.interval = *interval;
  map.finish();
}

void read_limits(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(node, findings);
  auto [limits, need] = section_of(draft.profile.limits);
  assign(limits.minimum_offset, map.number<std::uint16_t>("minimum-offset", need));
  assign(limits.maximum_offset, map.number<std::uint16_t>("maximum-offset", need));
  assign(limits.from, map.number<std::uint16_t>("from", need));
  assign(limits.to, map.number<std::uint16_t>("to", need));
  map.finish();
}

void read_numbered(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(node, findings);
  auto [numbered, need] = section_of(draft.profile.numbered);
  assign(numbered.prefix, map.text("prefix", need));
  assign(numbered.table, map.word("table", "table", modbus::table_words));
  assign(numbered.from, map.number<std::uint16_t>("from", need));
  assign(numbered.to, map.number<std::uint16_t>("to", need));
  assign(numbered.access, map.word("access", "access", catalogue::access_words));
  assign(numbered.evidence, map.word("evidence", "evidence", catalogue::evidence_words));
  assign(numbered.source, map.text("source"));
  map.finish();
}

// ---- codes ----

constexpr auto reset_words =
    enum_table<catalogue::Resettable>({{"possible", catalogue::Resettable::yes},
                                       {"power-cycle", catalogue::Resettable::no},
                                       {"", catalogue::Resettable::unknown}});

struct Provenance {
  Evidence evidence = Evidence::inferred;
  std::string source = {};
};

std::optional<CodeText> read_code_text(const YamlNode& node, const Provenance& from,
                                       Diagnostics& findings) {
  CodeText code{.text = {}, .remedy = {}, .evidence = from.evidence, .source = from.source};
  if (node.kind != YamlNode::Kind::map) {
    auto text = to_text(node, findings);
    if (!text) return std::nullopt;
    code.text = std::move(*text);
    return code;
  }
  YamlMap map(node, findings);
  assign(code.text, map.text("text", Need::required));
  assign(code.remedy, map.text("remedy"));
  assign(code.evidence, map.word("evidence", "evidence", catalogue::evidence_words));
  assign(code.source, map.text("source"));
  assign(code.resettable, map.word("reset", "reset", reset_words));
  map.finish();
  return code;
}

using Codes = std::map<std::int64_t, CodeText>;

void read_code_map(const YamlNode& node, const Provenance& from, Codes& codes,
                   Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<std::int64_t> seen;
  for (const YamlEntry& entry : node.entries) {
    const auto number = parse_unsigned(entry.key, last_register);
    if (!number) {
      findings.add(entry.key_at,
                   fmt::format("'{}' is not a code from 0 to {}", entry.key, last_register));
      continue;
    }
    const auto code = static_cast<std::int64_t>(*number);
    if (std::find(seen.begin(), seen.end(), code) != seen.end()) {
      findings.add(entry.key_at, fmt::format("code {} is given twice", entry.key));
    }
    seen.push_back(code);
    auto text = read_code_text(entry.value, from, findings);
    if (text) codes.insert_or_assign(code, std::move(*text));
  }
}

void read_code_maps(const YamlNode& node, Codes& codes, Diagnostics& findings) {
  if (node.kind != YamlNode::Kind::sequence) {
    read_code_map(node, {}, codes, findings);
    return;
  }
  for (const YamlNode& item : node.items) {
    YamlMap map(item, findings);
    Provenance from;
    assign(from.evidence,
           map.word("evidence", "evidence", catalogue::evidence_words, Need::required));
    assign(from.source, map.text("source", Need::required));
    const YamlNode* list = map.get("codes", Need::required);
    map.finish();
    if (list != nullptr) read_code_map(*list, from, codes, findings);
  }
}

}  // namespace

void read_codes(const YamlNode& node, catalogue::CodeTexts& table, Diagnostics& findings) {
  Codes codes = table.to_map();
  read_code_maps(node, codes, findings);
  table = std::move(codes);
}

namespace {

using ReadSection = void (*)(const YamlNode&, ProfileDraft&, Diagnostics&);

/// Reads a section that may be left out, and remembers where it stands.
void read_section(YamlMap& map, std::string_view key, ReadSection read, Origin& origin,
                  ProfileDraft& draft) {
  const YamlNode* node = map.get(key);
  if (node == nullptr) return;
  const std::size_t before = map.findings().told();
  read(*node, draft, map.findings());
  const bool sound = origin.sound && map.findings().told() == before;
  origin = {.entry = node, .layer = draft.layers, .sound = sound};
}

/// Erases entries that are not sound, side by side with where they were written.
template <typename Entry>
void erase_half_read(std::vector<Entry>& entries, std::vector<Origin>& origins) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (!origins[i].sound) continue;
    if (kept != i) {
      entries[kept] = std::move(entries[i]);
      origins[kept] = origins[i];
    }
    ++kept;
  }
  entries.resize(kept);
  origins.resize(kept);
}

// ---- simulation ----

void read_simulated_identity(const YamlNode& node, catalogue::SimulationSpec& facts,
                             Diagnostics& findings) {
  YamlMap map(node, findings);
  if (const YamlNode* bytes = map.get("bytes", Need::required)) {
    Bytes identity = to_bytes(*bytes, split(bytes->text, ' '), findings);
    // Behind function code and byte count.
    constexpr std::size_t most = modbus::max_pdu_size - 2;
    if (identity.size() > most) {
      findings.add(node.at, fmt::format("an answer holds at most {} bytes", most));
      identity.resize(most);
    }
    facts.identity = std::move(identity);
  }
  facts.identity_bytes =
      map.number<std::uint8_t>("answer").value_or(static_cast<std::uint8_t>(facts.identity.size()));
  if (facts.identity_bytes > facts.identity.size()) {
    findings.add(node.at, fmt::format("the answer has {} bytes, but only {} are given",
                                      facts.identity_bytes, facts.identity.size()));
  }
  map.finish();
}

std::vector<catalogue::SimulationSpec::Value> read_raw_values(const YamlNode& node,
                                                              Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<catalogue::SimulationSpec::Value> values;
  for (const YamlEntry& entry : node.entries) {
    const auto raw = parse_integer(entry.value.text);
    if (raw) {
      values.push_back({entry.key, *raw});
    } else {
      findings.add_once(entry.value.at, "a whole number is expected here");
    }
  }
  return values;
}

void read_simulated_limits(const YamlNode& node, catalogue::SimulationSpec& facts,
                           Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<catalogue::SimulationSpec::Limits> limits;
  for (const YamlEntry& entry : node.entries) {
    const auto range = to_range(entry.value, last_register, findings);
    if (!range) continue;
    limits.push_back(
        {entry.key, static_cast<std::int64_t>(range->from), static_cast<std::int64_t>(range->to)});
  }
  facts.limits = std::move(limits);
}

void read_simulated_events(const YamlNode& node, catalogue::SimulationSpec& facts,
                           Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<catalogue::SimulationSpec::Event> events;
  for (const YamlEntry& entry : node.entries) {
    const auto kind = to_kind(entry.key, entry.key_at, findings);
    expect(entry.value, YamlNode::Kind::sequence, findings);
    for (const YamlNode& item : entry.value.items) {
      auto values = read_raw_values(item, findings);
      if (kind) events.push_back({*kind, std::move(values)});
    }
  }
  facts.events = std::move(events);
}

void check_start_value(const catalogue::Profile& profile, const YamlEntry& entry, std::int64_t raw,
                       Diagnostics& findings) {
  const auto meant = profile.describe({entry.key});
  if (!meant) {
    findings.add(entry.key_at, message_of(meant.error()));
    return;
  }
  for (const catalogue::Parameter& parameter : *meant) {
    const catalogue::Kind kind = parameter.encoding.kind;
    if (raw >= catalogue::lowest(kind) && raw <= catalogue::highest(kind)) continue;
    findings.add_once(entry.value.at, fmt::format("does not fit {}, the encoding of {}",
                                                  catalogue::to_text(kind), parameter.name));
  }
}

}  // namespace

Position Origin::of(std::string_view key) const {
  if (const YamlNode* own = entry->find(key)) return own->at;
  if (group != nullptr) {
    if (const YamlNode* shared = group->find(key)) return shared->at;
  }
  return entry->at;
}

namespace {

/// Those that share a register with another one. That of a whole profile is meant.
std::set<std::size_t> sharing(const std::vector<catalogue::Parameter>& parameters) {
  std::map<std::pair<modbus::RegisterTable, unsigned>, std::size_t> owners;
  std::set<std::size_t> found;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const catalogue::Parameter& parameter = parameters[i];
    for (unsigned part = 0; part < catalogue::register_count(parameter.encoding.kind); ++part) {
      const auto [owner, is_first] =
          owners.try_emplace({parameter.table, parameter.address.value + part}, i);
      if (!is_first) found.insert({owner->second, i});
    }
  }
  return found;
}

}  // namespace

void ProfileDraft::begin_with(const catalogue::Profile& base, const YamlNode& node) {
  const Origin origin{.entry = &node, .layer = layers++};
  profile = base;
  read_parameters.assign(base.parameters.begin(), base.parameters.end());
  read_actions.assign(base.actions.begin(), base.actions.end());
  parameters.assign(read_parameters.size(), origin);
  actions.assign(read_actions.size(), origin);
  for (std::size_t i = 0; i < read_parameters.size(); ++i) {
    parameter_index.emplace(read_parameters[i].name, i);
  }
  for (const std::size_t index : sharing(read_parameters)) parameters[index].overlaps = true;
  const std::pair<bool, Origin*> sections[] = {{true, &link},
                                               {base.identity.has_value(), &identity},
                                               {base.events.has_value(), &events},
                                               {base.limits.has_value(), &limits},
                                               {base.numbered.has_value(), &numbered},
                                               {base.run.has_value(), &run},
                                               {base.refusals.has_value(), &refusals},
                                               {!base.alarm_lists.empty(), &alarm_lists},
                                               {!base.watched.empty(), &watched},
                                               {!base.alarm_reset.empty(), &alarm_reset}};
  for (const auto& [is_there, section] : sections) {
    if (is_there) *section = origin;
  }
}

void ProfileDraft::finish() {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!parameters[i].sound) half_read.insert(read_parameters[i].name);
  }
  erase_half_read(read_parameters, parameters);
  erase_half_read(read_actions, actions);
  profile.parameters = std::exchange(read_parameters, {});
  profile.actions = std::exchange(read_actions, {});
  parameter_index.clear();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    parameter_index.emplace(profile.parameters[i].name, i);
  }
  if (!identity.sound) profile.identity.reset();
  if (!events.sound) profile.events.reset();
  if (!limits.sound) profile.limits.reset();
  if (!numbered.sound) profile.numbered.reset();
  if (!run.sound) profile.run.reset();
  if (!refusals.sound) profile.refusals.reset();
  if (!alarm_lists.sound) profile.alarm_lists = {};
  if (!watched.sound) profile.watched = {};
  if (!alarm_reset.sound) profile.alarm_reset = {};
}

ProfileHead read_head(const YamlNode& document, Diagnostics& findings) {
  ProfileHead head;
  if (!expect(document, YamlNode::Kind::map, findings)) return head;
  YamlMap map(document, findings);
  const YamlNode* format = map.get("format", Need::required);
  if (format != nullptr && format->text != std::to_string(profile_format)) {
    findings.add(format->at, fmt::format("unknown format '{}'; this version reads format {}",
                                         format->text, profile_format));
  }
  if (const YamlNode* base = map.get("extends")) {
    assign(head.extends, to_text(*base, findings));
    head.extends_at = base->at;
  }
  assign(head.abstract, map.flag("abstract"));
  return head;
}

void read_profile(const YamlNode& document, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(document, findings);
  catalogue::Profile& profile = draft.profile;
  draft.top = {.entry = &document, .layer = draft.layers};
  for (const std::string_view head : {"format", "extends", "abstract"}) map.allow(head);
  assign(profile.id, map.text("id", Need::required));
  assign(profile.title, map.text("title", Need::required));
  assign(profile.maker, map.text("maker"));
  assign(profile.series, map.text("series"));
  read_section(map, "link", read_link, draft.link, draft);
  read_section(map, "identity", read_identity, draft.identity, draft);
  read_section(map, "events", read_events, draft.events, draft);
  read_section(map, "limits", read_limits, draft.limits, draft);
  read_section(map, "numbered", read_numbered, draft.numbered, draft);
  read_section(map, "run", read_run, draft.run, draft);
  read_section(map, "refusals", read_refusals, draft.refusals, draft);
  read_section(map, "alarm-lists", read_alarm_lists, draft.alarm_lists, draft);
  read_section(map, "watch", read_watched, draft.watched, draft);
  read_section(map, "alarm-reset", read_alarm_reset, draft.alarm_reset, draft);
  if (const YamlNode* codes = map.get("exceptions")) {
    read_codes(*codes, profile.exceptions, findings);
  }
  if (const YamlNode* list = map.get("parameters")) read_parameters(*list, draft, findings);
  if (const YamlNode* list = map.get("actions")) read_actions(*list, draft, findings);
  map.finish();
  ++draft.layers;
}

const YamlNode* find_part(const std::vector<YamlNode>& documents, Part part,
                          Diagnostics& findings) {
  const YamlNode* found = nullptr;
  for (std::size_t i = 1; i < documents.size(); ++i) {
    YamlMap map(documents[i], findings);
    constexpr auto part_words =
        enum_table<Part>({{"texts", Part::texts}, {"simulation", Part::simulation}});
    const auto name = map.word("part", "part", part_words, Need::required);
    if (!name || *name != part) continue;
    if (found != nullptr) {
      findings.add(documents[i].at,
                   fmt::format("a second document of part '{}'", part_words.text(part)));
    }
    found = &documents[i];
  }
  return found;
}

void read_texts(const YamlNode& document, catalogue::CodeTables& tables, Diagnostics& findings) {
  YamlMap map(document, findings);
  map.allow("part");
  if (const YamlNode* node = map.get("error-codes", Need::required)) {
    read_codes(*node, tables.error, findings);
  }
  if (const YamlNode* node = map.get("warning-codes")) {
    read_codes(*node, tables.warning, findings);
  }
  map.finish();
}

catalogue::SimulationSpec read_simulation(const YamlNode& document, Diagnostics& findings) {
  catalogue::SimulationSpec facts;
  YamlMap map(document, findings);
  map.allow("part");
  if (const YamlNode* node = map.get("identity")) {
    read_simulated_identity(*node, facts, findings);
  }
  if (const YamlNode* node = map.get("values")) facts.values = read_raw_values(*node, findings);
  if (const YamlNode* node = map.get("limits")) read_simulated_limits(*node, facts, findings);
  if (const YamlNode* node = map.get("events")) read_simulated_events(*node, facts, findings);
  assign(facts.limit_exception, map.number<std::uint8_t>("limit-exception"));
  assign(facts.stopped_error, map.number<std::uint16_t>("stopped-error"));
  if (const YamlNode* alarms = map.get("permanent-alarms")) {
    expect(*alarms, YamlNode::Kind::sequence, findings);
    std::vector<std::int64_t> codes;
    for (const YamlNode& item : alarms->items) {
      const auto code = to_unsigned(item, last_register, findings);
      if (code) codes.push_back(static_cast<std::int64_t>(*code));
    }
    facts.permanent_alarms = std::move(codes);
  }
  assign(facts.absent, read_areas(map.get("absent"), findings));
  map.finish();
  return facts;
}

void check_simulation(const catalogue::Profile& profile, const YamlNode& document,
                      Diagnostics& findings) {
  const auto check_values = [&](const YamlNode& values) {
    for (const YamlEntry& entry : values.entries) {
      const auto raw = parse_integer(entry.value.text).value_or(0);
      check_start_value(profile, entry, raw, findings);
    }
  };
  if (const YamlNode* values = document.find("values")) check_values(*values);
  if (const YamlNode* limits = document.find("limits")) {
    for (const YamlEntry& entry : limits->entries) {
      check_start_value(profile, entry, 0, findings);
    }
  }
  if (const YamlNode* events = document.find("events")) {
    for (const YamlEntry& event : events->entries) {
      for (const YamlNode& item : event.value.items) check_values(item);
    }
  }
}

}  // namespace spindle::files
