#include "files/profile_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "files/fields.hpp"
#include "files/known_keys.hpp"
#include "files/profile_codes.hpp"
#include "files/profile_entries.hpp"
#include "files/profile_run.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/profile_store.hpp"

namespace spindle::files {

template <>
constexpr std::string_view value_name<catalogue::UnitRange> = "range 0..255";

bool read_value(const YamlNode& node, catalogue::UnitRange& target, const Asked& asked) {
  std::pair<std::uint8_t, std::uint8_t> units;
  if (!read_value(node, units, asked)) return false;
  target = {units.first, units.second};
  return true;
}

/// From the first byte to the last.
template <>
constexpr std::string_view value_name<catalogue::Slice> = "range 0..255";

bool read_value(const YamlNode& node, catalogue::Slice& target, const Asked& asked) {
  std::pair<std::uint8_t, std::uint8_t> bytes;
  if (!read_value(node, bytes, asked)) return false;
  target = {bytes.first, static_cast<std::uint8_t>(bytes.second - bytes.first + 1)};
  return true;
}

/// Laid over what is there.
template <std::integral Number>
constexpr std::string_view value_name<catalogue::Table<Number, catalogue::Text>> = "text by number";

template <std::integral Number>
bool read_value(const YamlNode& node, catalogue::Table<Number, catalogue::Text>& target,
                const Asked& asked) {
  constexpr std::uint64_t last = std::numeric_limits<std::uint16_t>::max();
  std::map<Number, catalogue::Text> names = target.to_map();
  expect(node, YamlNode::Kind::map, asked.findings);
  for (const YamlEntry& entry : node.entries) {
    const auto number = parse_unsigned(entry.key, last);
    if (!number) {
      asked.findings.add(entry.key_at,
                         fmt::format("'{}' is not a number up to {}", entry.key, last));
    }
    auto text = to_text(entry.value, asked.findings);
    if (number && text) names.insert_or_assign(static_cast<Number>(*number), std::move(*text));
  }
  target = std::move(names);
  return true;
}

namespace {

using catalogue::Area;
using catalogue::EventSpec;
using catalogue::IdentitySpec;
using catalogue::LinkSpec;
using catalogue::Profile;
using catalogue::SerialSpec;
using catalogue::SimulationSpec;

constexpr std::uint64_t last_register = std::numeric_limits<std::uint16_t>::max();

// ---- register areas ----

constexpr Field<Area> area_fields[] = {
    range<&Area::from, &Area::to>("at", Need::required),
    field<&Area::note>("note"),
};

/// [1..725, {at: 564..568, note: "..."}]
void read_area_list(const YamlNode& node, std::vector<Area>& areas, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::sequence, asked.findings)) return;
  const Field<Area>& bare = area_fields[0];
  for (const YamlNode& item : node.items) {
    const std::size_t before = asked.findings.told();
    Area area{.table = *modbus::table_words.find(asked.key.name)};
    if (item.kind == YamlNode::Kind::map) {
      read_map(area_fields, item, area, asked.findings);
    } else {
      bare.read(item, area, asked);
    }
    if (asked.findings.told() == before) areas.push_back(std::move(area));
  }
}

constexpr Field<std::vector<Area>> areas_fields[] = {
    custom("holding", Need::optional, "list of ranges", read_area_list),
    custom("input", Need::optional, "list of ranges", read_area_list),
    custom("coil", Need::optional, "list of ranges", read_area_list),
    custom("discrete", Need::optional, "list of ranges", read_area_list),
};

}  // namespace

bool read_value(const YamlNode& node, catalogue::List<Area>& target, const Asked& asked) {
  std::vector<Area> areas;
  read_map(areas_fields, node, areas, asked.findings);
  target = std::move(areas);
  return true;
}

namespace {

// ---- link ----

constexpr auto framing_words =
    enum_table<modbus::Framing>({{"tcp", modbus::Framing::tcp}, {"rtu", modbus::Framing::rtu}});
constexpr auto pair_words = enum_table<bool>({{"even", true}, {"any", false}});

void read_write_function(const YamlNode& node, LinkSpec& link, const Asked& asked) {
  constexpr auto single = static_cast<std::uint8_t>(modbus::FunctionCode::write_single_register);
  constexpr auto several =
      static_cast<std::uint8_t>(modbus::FunctionCode::write_multiple_registers);
  std::uint8_t function = 0;
  if (!read_value(node, function, asked)) return;
  if (function == single || function == several) {
    link.write_function = function;
  } else {
    asked.findings.add(node.at,
                       fmt::format("function {} writes no register; it is 6 or 16", function));
  }
}

void read_busy(const YamlNode& node, LinkSpec& link, const Asked& asked) {
  std::vector<std::uint8_t> codes;
  for (const std::int64_t code : to_numbers<std::uint8_t>(node, asked.findings)) {
    codes.push_back(static_cast<std::uint8_t>(code));
  }
  link.busy = std::move(codes);
}

constexpr Field<catalogue::GapRule> gap_fields[] = {
    field<&catalogue::GapRule::up_to_baud>("up-to"),
    field<&catalogue::GapRule::gap>("gap", Need::required),
};

constexpr Field<SerialSpec> serial_fields[] = {
    field<&SerialSpec::line, &modbus::SerialSettings::baud>("baud"),
    word<modbus::parity_words, &SerialSpec::line, &modbus::SerialSettings::parity>("parity"),
    field<&SerialSpec::line, &modbus::SerialSettings::stop_bits>("stop"),
    list_of<gap_fields, &SerialSpec::gaps>("gaps"),
    field<&SerialSpec::broadcast_pause>("broadcast-pause"),
};

constexpr Field<catalogue::UnaskedFrame> unasked_fields[] = {
    field<&catalogue::UnaskedFrame::function>("function", Need::required),
    field<&catalogue::UnaskedFrame::count>("count", Need::required),
};

constexpr Field<LinkSpec> link_fields[] = {
    word<framing_words, &LinkSpec::framing>("framing", Need::inherited),
    field<&LinkSpec::port>("port"),
    field<&LinkSpec::unit>("unit"),
    field<&LinkSpec::units>("units"),
    word<modbus::transaction_words, &LinkSpec::transactions>("transaction"),
    field<&LinkSpec::max_read>("max-read"),
    field<&LinkSpec::max_write>("max-write"),
    field<&LinkSpec::max_read_bits>("max-read-bits"),
    custom("write-function", Need::optional, "6 | 16", read_write_function),
    field<&LinkSpec::max_gap>("max-gap"),
    custom("busy", Need::optional, "list of exception codes", read_busy),
    field<&LinkSpec::busy_every>("busy-every"),
    field<&LinkSpec::busy_limit>("busy-limit"),
    word<catalogue::word_order_words, &LinkSpec::word_order>("word-order"),
    word<catalogue::byte_order_words, &LinkSpec::byte_order>("byte-order"),
    field<&LinkSpec::keep_alive>("keep-alive"),
    field<&LinkSpec::answer>("answer"),
    field<&LinkSpec::connect>("connect"),
    field<&LinkSpec::retries>("retries"),
    field<&LinkSpec::settle>("settle"),
    field<&LinkSpec::loopback>("loopback"),
    field<&LinkSpec::any_unit>("any-unit"),
    word<pair_words, &LinkSpec::even_pairs>("pairs"),
    map_of<serial_fields, &LinkSpec::serial>("serial"),
    field<&LinkSpec::contiguous>("contiguous").with(keys_of<areas_fields>),
    field<&LinkSpec::absent>("absent").with(keys_of<areas_fields>),
    list_of<unasked_fields, &LinkSpec::unasked>("unasked"),
};

// ---- identity ----

constexpr Field<IdentitySpec> long_serial_fields[] = {
    field<&IdentitySpec::long_serial_bytes>("from-bytes", Need::inherited),
    field<&IdentitySpec::long_serial>("at", Need::inherited),
    field<&IdentitySpec::product_byte>("product-at"),
    field<&IdentitySpec::products>("products"),
};

constexpr Field<IdentitySpec> total_fields[] = {
    field<&IdentitySpec::total_bytes>("from-bytes", Need::inherited),
    field<&IdentitySpec::total>("at", Need::inherited),
};

constexpr Field<catalogue::FirmwareCaution> caution_fields[] = {
    range<&catalogue::FirmwareCaution::from, &catalogue::FirmwareCaution::to>("firmware",
                                                                              Need::required),
    field<&catalogue::FirmwareCaution::text>("text", Need::required),
};

constexpr Field<IdentitySpec> told_fields[] = {
    field<&IdentitySpec::model_from>("model"),
    field<&IdentitySpec::serial_from>("serial"),
    field<&IdentitySpec::version_from>("version"),
};

void read_told(const YamlNode& node, IdentitySpec& identity, const Asked& asked) {
  read_map(told_fields, node, identity, asked.findings);
}

void read_long_serial(const YamlNode& node, IdentitySpec& identity, const Asked& asked) {
  read_map(long_serial_fields, node, identity, asked.findings, identity.long_serial_bytes != 0);
}

void read_total(const YamlNode& node, IdentitySpec& identity, const Asked& asked) {
  read_map(total_fields, node, identity, asked.findings, identity.total_bytes != 0);
}

constexpr Field<IdentitySpec> identity_fields[] = {
    field<&IdentitySpec::minimum_bytes>("minimum-bytes", Need::inherited),
    field<&IdentitySpec::id>("id"),
    field<&IdentitySpec::controller_model>("controller-model"),
    field<&IdentitySpec::tool_model>("tool-model", Need::inherited),
    field<&IdentitySpec::firmware>("firmware", Need::inherited),
    field<&IdentitySpec::serial>("serial", Need::inherited),
    custom("long-serial", Need::optional, "map", read_long_serial)
        .with(keys_of<long_serial_fields>),
    custom("total", Need::optional, "map", read_total).with(keys_of<total_fields>),
    field<&IdentitySpec::models>("models"),
    field<&IdentitySpec::firmware_from>("firmware-from"),
    field<&IdentitySpec::firmware_below>("firmware-below"),
    list_of<caution_fields, &IdentitySpec::cautions>("cautions"),
    custom("told-by", Need::optional, "map", read_told).with(keys_of<told_fields>),
};

// ---- events, limits, numbered ----

constexpr auto source_words =
    enum_table<catalogue::EventModel>({{"push", catalogue::EventModel::push},
                                       {"counter", catalogue::EventModel::counter},
                                       {"flag", catalogue::EventModel::flag}});

constexpr Field<catalogue::Arming> arm_fields[] = {
    field<&catalogue::Arming::address>("register", Need::inherited),
    field<&catalogue::Arming::value>("value"),
    field<&catalogue::Arming::disarm>("disarm"),
    field<&catalogue::Arming::every>("every"),
    field<&catalogue::Arming::expires>("expires"),
};

constexpr Field<catalogue::EventColumn> column_fields[] = {
    field<&catalogue::EventColumn::heading>("heading", Need::required),
    field<&catalogue::EventColumn::parameter>("parameter", Need::required),
    field_as<std::uint8_t, &catalogue::EventColumn::width>("width"),
};

constexpr Field<catalogue::EventSetting> setting_fields[] = {
    word<catalogue::setting_kind_words, &catalogue::EventSetting::is>("is", Need::required,
                                                                      "setting"),
    field<&catalogue::EventSetting::parameter>("parameter", Need::required),
};

constexpr Field<catalogue::EventForm> form_fields[] = {
    field<&catalogue::EventForm::count>("count", Need::required),
    field<&catalogue::EventForm::parameters>("parameters", Need::required),
    field<&catalogue::EventForm::firmware_from>("firmware-from"),
};

std::optional<catalogue::EventKind> to_kind(const std::string& name, const SourceLocation& at,
                                            Diagnostics& findings) {
  const auto kind = catalogue::event_kind_words.find(name);
  if (!kind) {
    findings.add_once(at, unknown_word("event kind", name, catalogue::event_kind_words.words()));
  }
  return kind;
}

void read_kinds(const YamlNode& node, EventSpec& events, const Asked& asked) {
  catalogue::Table<std::int64_t, catalogue::Text> names;
  read_value(node, names, asked);
  std::map<std::int64_t, catalogue::EventKind> kinds = events.kinds.to_map();
  for (const auto& [number, name] : names) {
    const auto kind = to_kind(name, node.at, asked.findings);
    if (kind) kinds.insert_or_assign(number, *kind);
  }
  events.kinds = std::move(kinds);
}

constexpr Field<catalogue::EventFrame> frame_fields[] = {
    field<&catalogue::EventFrame::function>("function", Need::required),
    word<catalogue::frame_content_words, &catalogue::EventFrame::holds>("holds", Need::required,
                                                                        "content"),
};

constexpr Field<catalogue::CurveChannel> channel_fields[] = {
    field<&catalogue::CurveChannel::type>("type", Need::required),
    field<&catalogue::CurveChannel::count>("count", Need::required),
};

constexpr Field<catalogue::CurveType> curve_type_fields[] = {
    field<&catalogue::CurveType::number>("number", Need::required),
    word<catalogue::curve_quantity_words, &catalogue::CurveType::is>("is", Need::required,
                                                                     "quantity"),
    field<&catalogue::CurveType::unit>("unit"),
};

constexpr Field<catalogue::CurveSpec> curve_fields[] = {
    list_of<channel_fields, &catalogue::CurveSpec::channels>("channels", Need::required),
    list_of<curve_type_fields, &catalogue::CurveSpec::types>("types", Need::required),
    field<&catalogue::CurveSpec::sampling>("sampling"),
    field<&catalogue::CurveSpec::most>("most", Need::required),
    field<&catalogue::CurveSpec::steps>("steps"),
    field<&catalogue::CurveSpec::first_step>("first-step"),
    field<&catalogue::CurveSpec::step_types>("step-types"),
};

constexpr Field<catalogue::BlockSearch> search_fields[] = {
    field<&catalogue::BlockSearch::name>("name", Need::inherited),
    field<&catalogue::BlockSearch::title>("title"),
    field<&catalogue::BlockSearch::count>("count", Need::inherited),
    range<&catalogue::BlockSearch::from, &catalogue::BlockSearch::to>("registers", Need::inherited),
    field<&catalogue::BlockSearch::step>("step", Need::inherited),
};

constexpr Field<EventSpec> event_fields[] = {
    word<source_words, &EventSpec::model>("source", Need::optional, "source of events"),
    map_of<arm_fields, &EventSpec::arm>("arm"),
    field<&EventSpec::function>("function", Need::inherited),
    field_as<std::uint16_t, &EventSpec::first>("first"),
    field<&EventSpec::count>("count", Need::inherited),
    field<&EventSpec::number>("number"),
    field<&EventSpec::flag>("flag"),
    field<&EventSpec::kind>("kind", Need::inherited),
    custom("kinds", Need::optional, "kind of event by number", read_kinds),
    field<&EventSpec::error>("error"),
    list_of<column_fields, &EventSpec::columns>("columns"),
    field<&EventSpec::interval>("interval"),
    field<&EventSpec::preset>("preset"),
    list_of<setting_fields, &EventSpec::settings>("settings"),
    list_of<form_fields, &EventSpec::longer>("longer"),
    list_of<frame_fields, &EventSpec::frames>("frames"),
    field<&EventSpec::identity>("told-apart-by"),
    field<&EventSpec::torque_unit>("torque-unit"),
    map_of<curve_fields, &EventSpec::curves>("curves"),
    map_of<search_fields, &EventSpec::search>("search"),
};

// ---- how tools are found, and what they can show ----

constexpr Field<catalogue::DiscoverySpec> discovery_fields[] = {
    field<&catalogue::DiscoverySpec::group>("group", Need::inherited),
    field<&catalogue::DiscoverySpec::port>("port", Need::inherited),
    field<&catalogue::DiscoverySpec::ask>("ask", Need::inherited),
    field<&catalogue::DiscoverySpec::answer>("answer", Need::inherited),
    field<&catalogue::DiscoverySpec::bytes>("bytes", Need::inherited),
    field<&catalogue::DiscoverySpec::every>("every"),
    field<&catalogue::DiscoverySpec::serial>("serial"),
    field<&catalogue::DiscoverySpec::model>("model"),
    field<&catalogue::DiscoverySpec::address>("address"),
    field<&catalogue::DiscoverySpec::tool_port>("tool-port"),
    field<&catalogue::DiscoverySpec::mac>("mac"),
    field<&catalogue::DiscoverySpec::firmware>("firmware"),
    field<&catalogue::DiscoverySpec::in_use>("in-use"),
    field<&catalogue::DiscoverySpec::kind>("kind"),
    field<&catalogue::DiscoverySpec::kinds>("kinds"),
};

constexpr Field<catalogue::LearnedAction> learned_action_fields[] = {
    field<&catalogue::LearnedAction::name>("name", Need::required),
    field<&catalogue::LearnedAction::title>("title", Need::required),
    field<&catalogue::LearnedAction::follows>("follows", Need::required),
    word<catalogue::learned_by_words, &catalogue::LearnedAction::by>("by", Need::optional,
                                                                     "way to show itself"),
    field<&catalogue::LearnedAction::deed>("deed", Need::required),
    range<&catalogue::LearnedAction::minimum, &catalogue::LearnedAction::maximum>("range"),
    field<&catalogue::LearnedAction::labels>("labels"),
    word<catalogue::hazard_words, &catalogue::LearnedAction::hazard>("hazard", Need::required),
    field<&catalogue::LearnedAction::check>("check", Need::required),
};

constexpr Field<catalogue::LearnSpec> learn_fields[] = {
    word<modbus::table_words, &catalogue::LearnSpec::table>("table"),
    range<&catalogue::LearnSpec::from, &catalogue::LearnSpec::to>("registers", Need::inherited),
    list_of<learned_action_fields, &catalogue::LearnSpec::actions>("actions", Need::inherited),
};

constexpr Field<catalogue::LimitSpec> limit_fields[] = {
    field<&catalogue::LimitSpec::minimum_offset>("minimum-offset", Need::inherited),
    field<&catalogue::LimitSpec::maximum_offset>("maximum-offset", Need::inherited),
    field<&catalogue::LimitSpec::from>("from", Need::inherited),
    field<&catalogue::LimitSpec::to>("to", Need::inherited),
};

constexpr Field<catalogue::NumberedSpec> numbered_fields[] = {
    field<&catalogue::NumberedSpec::prefix>("prefix", Need::inherited),
    word<modbus::table_words, &catalogue::NumberedSpec::table>("table"),
    field<&catalogue::NumberedSpec::from>("from", Need::inherited),
    field<&catalogue::NumberedSpec::to>("to", Need::inherited),
    word<catalogue::access_words, &catalogue::NumberedSpec::access>("access"),
    word<catalogue::evidence_words, &catalogue::NumberedSpec::evidence>("evidence"),
    field<&catalogue::NumberedSpec::source>("source"),
};

// ---- what a product says of refused requests, and its lists of codes ----

constexpr auto code_table_words =
    enum_table<catalogue::CodeTable>({{"error-codes", catalogue::CodeTable::error},
                                      {"warning-codes", catalogue::CodeTable::warning},
                                      {"refusals", catalogue::CodeTable::refusal},
                                      {"none", catalogue::CodeTable::none}});

constexpr Field<catalogue::ExtendedErrorSpec> refusal_fields[] = {
    field<&catalogue::ExtendedErrorSpec::parameter>("parameter", Need::inherited),
    field<&catalogue::ExtendedErrorSpec::codes>("codes", Need::inherited),
    numbers<std::uint16_t, &catalogue::ExtendedErrorSpec::busy>("busy"),
    field<&catalogue::ExtendedErrorSpec::retry_every>("retry-every"),
    field<&catalogue::ExtendedErrorSpec::give_up_after>("give-up-after"),
};

constexpr Field<catalogue::UnlockSpec> unlock_fields[] = {
    field<&catalogue::UnlockSpec::parameter>("parameter", Need::inherited),
    field_as<std::uint32_t, &catalogue::UnlockSpec::value>("value", Need::inherited),
    field<&catalogue::UnlockSpec::needed_by>("for"),
};

void read_alarm_parameters(const YamlNode& node, catalogue::AlarmList& list, const Asked& asked) {
  catalogue::Text pattern;
  if (read_value(node, pattern, asked)) list.parameters = {pattern};
}

constexpr Field<catalogue::AlarmList> alarm_list_fields[] = {
    field<&catalogue::AlarmList::name>("list", Need::required),
    custom("parameters", Need::required, "text", read_alarm_parameters),
    word<code_table_words, &catalogue::AlarmList::codes>("codes", Need::required, "table"),
};

// ---- the first document ----

void read_format(const YamlNode& node, ProfileHead&, const Asked& asked) {
  if (node.text == std::to_string(profile_format)) return;
  asked.findings.add(node.at, fmt::format("unknown format '{}'; this version reads format {}",
                                          node.text, profile_format));
}

void read_extends(const YamlNode& node, ProfileHead& head, const Asked& asked) {
  read_value(node, head.extends, asked);
  head.extends_at = node.at;
}

constexpr Field<ProfileHead> head_fields[] = {
    custom("format", Need::required, "1", read_format),
    custom("extends", Need::optional, "text", read_extends),
    field<&ProfileHead::abstract>("abstract"),
};

constexpr Field<ProfileDraft> title_fields[] = {
    field<&ProfileDraft::profile, &Profile::id>("id", Need::required),
    field<&ProfileDraft::profile, &Profile::title>("title", Need::required),
    field<&ProfileDraft::profile, &Profile::maker>("maker"),
    field<&ProfileDraft::profile, &Profile::series>("series"),
};

void read_dropped(const YamlNode& node, ProfileDraft& draft, const Asked& asked) {
  catalogue::List<catalogue::Text> names;
  if (read_value(node, names, asked)) draft.dropped = to_strings(names);
}

/// Shared by all entries of the file, which look for it themselves.
void read_nothing(const YamlNode&, ProfileDraft&, const Asked&) {}

/// What a file says of all its entries.
constexpr Field<ProfileDraft> common_fields[] = {
    word<numbering_words, &ProfileDraft::numbering>("numbering"),
    custom("evidence", Need::optional, "of all entries", read_nothing),
    custom("source", Need::optional, "of all entries", read_nothing),
    custom("access", Need::optional, "of all parameters", read_nothing),
    custom("drop", Need::optional, "list of names or patterns", read_dropped),
    word<catalogue::evidence_words, &ProfileDraft::inherited_evidence>("inherited-evidence",
                                                                       Need::optional, "evidence"),
};

constexpr Field<ProfileDraft> list_fields[] = {
    word<catalogue::writes_words, &ProfileDraft::profile, &Profile::writes>("writes"),
    field<&ProfileDraft::profile, &Profile::exceptions>("exceptions").with(code_list_keys),
    custom("parameters", Need::optional, "list of maps", read_parameters).with(parameter_keys),
    custom("event-fields", Need::optional, "list of maps", read_event_fields),
    custom("actions", Need::optional, "list of maps", read_actions).with(action_keys),
};

/// A section that may be left out, and where it is remembered.
struct Section {
  Field<ProfileDraft> field;
  Origin ProfileDraft::*origin;
  bool (*is_there)(const Profile& profile);
  void (*drop)(Profile& profile);
};

bool is_there(const LinkSpec&) { return true; }
bool is_there(const auto& list) { return !list.empty(); }
template <typename Facts>
bool is_there(const std::optional<Facts>& facts) {
  return facts.has_value();
}

/// How to talk to it is asked of every profile.
void drop(LinkSpec&) {}
template <typename Facts>
void drop(Facts& facts) {
  facts = Facts();
}

template <auto facts>
constexpr Section section(const Field<ProfileDraft>& field, Origin ProfileDraft::*origin) {
  return {field, origin, [](const Profile& profile) { return is_there(profile.*facts); },
          [](Profile& profile) { drop(profile.*facts); }};
}

template <auto facts, const auto& fields>
constexpr Section map_section(std::string_view name, Origin ProfileDraft::*origin) {
  return section<facts>(map_of<fields, &ProfileDraft::profile, facts>(name), origin);
}

constexpr Section sections[] = {
    map_section<&Profile::link, link_fields>("link", &ProfileDraft::link),
    map_section<&Profile::identity, identity_fields>("identity", &ProfileDraft::identity),
    map_section<&Profile::events, event_fields>("events", &ProfileDraft::events),
    map_section<&Profile::limits, limit_fields>("limits", &ProfileDraft::limits),
    map_section<&Profile::numbered, numbered_fields>("numbered", &ProfileDraft::numbered),
    section<&Profile::run>(custom("run", Need::optional, "map", read_run).with(run_keys),
                           &ProfileDraft::run),
    map_section<&Profile::refusals, refusal_fields>("refusals", &ProfileDraft::refusals),
    section<&Profile::alarm_lists>(
        list_of<alarm_list_fields, &ProfileDraft::profile, &Profile::alarm_lists>("alarm-lists"),
        &ProfileDraft::alarm_lists),
    section<&Profile::watched>(field<&ProfileDraft::profile, &Profile::watched>("watch"),
                               &ProfileDraft::watched),
    section<&Profile::alarm_reset>(
        field<&ProfileDraft::profile, &Profile::alarm_reset>("alarm-reset"),
        &ProfileDraft::alarm_reset),
    map_section<&Profile::unlock, unlock_fields>("unlock", &ProfileDraft::unlock),
    section<&Profile::torque_unit_from>(
        field<&ProfileDraft::profile, &Profile::torque_unit_from>("torque-unit"),
        &ProfileDraft::torque_unit),
    map_section<&Profile::discovery, discovery_fields>("discovery", &ProfileDraft::discovery),
    map_section<&Profile::learn, learn_fields>("learn", &ProfileDraft::learn),
};

/// Reads a section where it is there, and remembers where it stands.
void read_section(const Section& section, YamlMap& map, ProfileDraft& draft, bool inherited) {
  const Diagnostics& findings = map.findings();
  const std::size_t before = findings.told();
  if (!read_field(section.field, map, draft, inherited)) return;
  Origin& origin = draft.*section.origin;
  const bool sound = origin.sound && findings.told() == before;
  origin = {
      .entry = map.node().find(section.field.key.name), .layer = draft.layers, .sound = sound};
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

void read_identity_bytes(const YamlNode& node, SimulationSpec& facts, const Asked& asked) {
  Bytes identity = to_bytes(node, split(node.text, ' '), asked.findings);
  // Behind function code and byte count.
  constexpr std::size_t most = modbus::max_pdu_size - 2;
  if (identity.size() > most) {
    asked.findings.add(asked.map.at, fmt::format("an answer holds at most {} bytes", most));
    identity.resize(most);
  }
  facts.identity_bytes = identity.size();
  facts.identity = std::move(identity);
}

constexpr Field<SimulationSpec> simulated_identity_fields[] = {
    custom("bytes", Need::required, "bytes in hexadecimal digits", read_identity_bytes),
    field_as<std::uint8_t, &SimulationSpec::identity_bytes>("answer"),
};

void read_simulated_identity(const YamlNode& node, SimulationSpec& facts, const Asked& asked) {
  read_map(simulated_identity_fields, node, facts, asked.findings);
  if (facts.identity_bytes <= facts.identity.size()) return;
  asked.findings.add(node.at, fmt::format("the answer has {} bytes, but only {} are given",
                                          facts.identity_bytes, facts.identity.size()));
}

std::vector<SimulationSpec::Value> to_raw_values(const YamlNode& node, Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<SimulationSpec::Value> values;
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

void read_raw_values(const YamlNode& node, SimulationSpec& facts, const Asked& asked) {
  facts.values = to_raw_values(node, asked.findings);
}

void read_simulated_limits(const YamlNode& node, SimulationSpec& facts, const Asked& asked) {
  expect(node, YamlNode::Kind::map, asked.findings);
  std::vector<SimulationSpec::Limits> limits;
  for (const YamlEntry& entry : node.entries) {
    const auto range = to_range(entry.value, last_register, asked.findings);
    if (!range) continue;
    limits.push_back(
        {entry.key, static_cast<std::int64_t>(range->from), static_cast<std::int64_t>(range->to)});
  }
  facts.limits = std::move(limits);
}

void read_simulated_events(const YamlNode& node, SimulationSpec& facts, const Asked& asked) {
  expect(node, YamlNode::Kind::map, asked.findings);
  std::vector<SimulationSpec::Event> events;
  for (const YamlEntry& entry : node.entries) {
    const auto kind = to_kind(entry.key, entry.key_at, asked.findings);
    expect(entry.value, YamlNode::Kind::sequence, asked.findings);
    for (const YamlNode& item : entry.value.items) {
      auto values = to_raw_values(item, asked.findings);
      if (kind) events.push_back({*kind, std::move(values)});
    }
  }
  facts.events = std::move(events);
}

constexpr Field<SimulationSpec> simulation_fields[] = {
    custom("identity", Need::optional, "map", read_simulated_identity)
        .with(keys_of<simulated_identity_fields>),
    custom("values", Need::optional, "numbers by pattern", read_raw_values),
    custom("limits", Need::optional, "ranges by pattern", read_simulated_limits),
    custom("events", Need::optional, "lists of maps by kind of event", read_simulated_events),
    field<&SimulationSpec::limit_exception>("limit-exception"),
    field<&SimulationSpec::stopped_error>("stopped-error"),
    numbers<std::uint16_t, &SimulationSpec::permanent_alarms>("permanent-alarms"),
    field<&SimulationSpec::absent>("absent").with(keys_of<areas_fields>),
};

void check_start_value(const catalogue::Profile& profile, const YamlEntry& entry, std::int64_t raw,
                       Diagnostics& findings) {
  const auto meant = profile.describe({entry.key});
  if (!meant) {
    findings.add(entry.key_at, message_of(meant.error()));
    return;
  }
  for (const catalogue::Parameter& parameter : *meant) {
    const catalogue::Encoding& encoding = parameter.encoding;
    const bool fits = encoding.is_integer() && Decimal(raw) >= catalogue::lowest(encoding) &&
                      Decimal(raw) <= catalogue::highest(encoding);
    if (fits || encoding.is_float()) continue;
    findings.add_once(entry.value.at,
                      fmt::format("does not fit {}, the encoding of {}",
                                  catalogue::to_text(encoding.kind), parameter.name));
  }
}

}  // namespace

SourceLocation Origin::of(std::string_view key) const {
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
    for (unsigned part = 0; part < catalogue::register_count(parameter.encoding); ++part) {
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
  if (base.events) event_fields.assign(base.events->fields.begin(), base.events->fields.end());
  parameters.assign(read_parameters.size(), origin);
  actions.assign(read_actions.size(), origin);
  for (std::size_t i = 0; i < read_parameters.size(); ++i) {
    parameter_index.emplace(read_parameters[i].name, i);
  }
  for (const std::size_t index : sharing(read_parameters)) parameters[index].overlaps = true;
  for (const Section& section : sections) {
    if (section.is_there(base)) this->*section.origin = origin;
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
  for (const Section& section : sections) {
    if (!(this->*section.origin).sound) section.drop(profile);
  }
  if (profile.events) finish_event_fields(*profile.events);
}

/// Where the place of the block is known, its parameters are parameters like all others.
void ProfileDraft::finish_event_fields(EventSpec& spec) {
  spec.fields = std::exchange(event_fields, {});
  if (!spec.first) return;
  std::vector<catalogue::Parameter> all(profile.parameters.begin(), profile.parameters.end());
  for (catalogue::Parameter field : spec.fields) {
    const unsigned address = unsigned{*spec.first} + field.address.value;
    if (address > last_register || !parameter_index.try_emplace(field.name, all.size()).second) {
      continue;
    }
    field.table = catalogue::table_of(spec);
    field.address = {static_cast<std::uint16_t>(address)};
    all.push_back(std::move(field));
    parameters.push_back(events);
  }
  profile.parameters = std::move(all);
}

ProfileHead read_head(const YamlNode& document, Diagnostics& findings) {
  ProfileHead head;
  if (!expect(document, YamlNode::Kind::map, findings)) return head;
  YamlMap map(document, findings);
  read_fields(head_fields, map, head);
  return head;
}

namespace {

/// Leaves out what a base says and this file drops, side by side with where it was written.
template <typename Entry>
std::size_t drop_named(std::string_view pattern, std::vector<Entry>& entries,
                       std::vector<Origin>& origins) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].name == pattern || glob_match(pattern, entries[i].name)) continue;
    if (kept != i) {
      entries[kept] = std::move(entries[i]);
      origins[kept] = origins[i];
    }
    ++kept;
  }
  const std::size_t dropped = entries.size() - kept;
  entries.resize(kept);
  origins.resize(kept);
  return dropped;
}

/// What a file says of all that its base says.
void change_inherited(ProfileDraft& draft, Diagnostics& findings) {
  for (const std::string& pattern : draft.dropped) {
    const std::size_t dropped = drop_named(pattern, draft.read_parameters, draft.parameters) +
                                drop_named(pattern, draft.read_actions, draft.actions);
    if (dropped == 0 && !draft.incomplete) {
      findings.add(draft.top.of("drop"), fmt::format("'{}' is nothing that a base has", pattern));
    }
  }
  if (!draft.dropped.empty()) {
    draft.parameter_index.clear();
    for (std::size_t i = 0; i < draft.read_parameters.size(); ++i) {
      draft.parameter_index.emplace(draft.read_parameters[i].name, i);
    }
  }
  if (!draft.inherited_evidence) return;
  const auto lower = [&](auto& entry) {
    entry.evidence = std::max(entry.evidence, *draft.inherited_evidence);
  };
  std::for_each(draft.read_parameters.begin(), draft.read_parameters.end(), lower);
  std::for_each(draft.read_actions.begin(), draft.read_actions.end(), lower);
}

}  // namespace

void read_profile(const YamlNode& document, ProfileDraft& draft, Diagnostics& findings) {
  YamlMap map(document, findings);
  draft.top = {.entry = &document, .layer = draft.layers};
  for (const Field<ProfileHead>& head : head_fields) map.know(head.key.name);
  read_fields(title_fields, map, draft);
  draft.numbering = Numbering::address;
  draft.dropped.clear();
  draft.inherited_evidence.reset();
  read_fields(common_fields, map, draft);
  change_inherited(draft, findings);
  const bool has_link = draft.link.entry != nullptr || draft.incomplete;
  for (const Section& section : sections) read_section(section, map, draft, has_link);
  read_fields(list_fields, map, draft);
  map.finish();
  ++draft.layers;
}

namespace {

constexpr auto part_words =
    enum_table<Part>({{"texts", Part::texts}, {"simulation", Part::simulation}});

struct PartHead {
  std::optional<Part> part = std::nullopt;
};

constexpr Field<PartHead> part_fields[] = {
    word<part_words, &PartHead::part>("part", Need::required),
};

constexpr Field<catalogue::CodeTables> text_fields[] = {
    field<&catalogue::CodeTables::error>("error-codes", Need::required).with(code_list_keys),
    field<&catalogue::CodeTables::warning>("warning-codes").with(code_list_keys),
};

}  // namespace

const YamlNode* find_part(const std::vector<YamlNode>& documents, Part part,
                          Diagnostics& findings) {
  const YamlNode* found = nullptr;
  for (std::size_t i = 1; i < documents.size(); ++i) {
    PartHead head;
    YamlMap map(documents[i], findings);
    read_fields(part_fields, map, head);
    if (head.part != part) continue;
    if (found != nullptr) {
      findings.add(documents[i].at,
                   fmt::format("a second document of part '{}'", part_words.text(part)));
    }
    found = &documents[i];
  }
  return found;
}

namespace {

template <typename T, std::size_t count>
void read_part(const Field<T> (&fields)[count], const YamlNode& document, T& facts,
               Diagnostics& findings) {
  YamlMap map(document, findings);
  PartHead head;
  read_fields(part_fields, map, head);
  read_fields(fields, map, facts);
  map.finish();
}

}  // namespace

void read_texts(const YamlNode& document, catalogue::CodeTables& tables, Diagnostics& findings) {
  read_part(text_fields, document, tables, findings);
}

catalogue::SimulationSpec read_simulation(const YamlNode& document, Diagnostics& findings) {
  catalogue::SimulationSpec facts;
  read_part(simulation_fields, document, facts, findings);
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

std::vector<KeyList> profile_keys() {
  KeyList document{"profile", keys_of<head_fields, title_fields, common_fields>()};
  for (const Section& section : sections) document.keys.push_back(section.field.key);
  for (const Key& key : keys_of<list_fields>()) document.keys.push_back(key);
  std::vector<KeyList> lists;
  for (Key& key : document.keys) {
    // Those of a section stand in a list of their own.
    if (const auto inner = std::exchange(key.inner, nullptr)) {
      lists.push_back({std::string(key.name), inner()});
    }
  }
  lists.push_back(std::move(document));
  for (KeyList& list : run_model_keys()) lists.push_back(std::move(list));
  lists.push_back({"texts", keys_of<part_fields, text_fields>()});
  lists.push_back({"simulation", keys_of<part_fields, simulation_fields>()});
  return lists;
}

}  // namespace spindle::files
