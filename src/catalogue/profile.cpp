#include "spindle/catalogue/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <unordered_set>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/document_number.hpp"

namespace spindle::catalogue {
namespace {

using modbus::RegisterAddress;
using modbus::RegisterTable;

constexpr std::uint16_t last_register = std::numeric_limits<std::uint16_t>::max();

/// Its digits fit 64 bits.
constexpr std::uint64_t longest_bcd = 8;

Error unknown(std::string_view name, std::string message, std::string hint) {
  return {.code = Errc::unknown_name,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = std::string(name)};
}

template <typename Entries>
std::vector<std::string> names_of(const Entries& entries) {
  std::vector<std::string> names;
  names.reserve(entries.size());
  for (const auto& entry : entries) names.push_back(entry.name);
  return names;
}

Parameter make_numbered(const NumberedSpec& facts, std::uint16_t number) {
  return {.name = fmt::format("{}{}", facts.prefix, number),
          .title = fmt::format("Parameter {}", number),
          .table = facts.table,
          .address = {number},
          .encoding = {},
          .unit = {},
          .access = facts.access,
          .evidence = facts.evidence,
          .source = facts.source,
          .note = {}};
}

bool all_digits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::optional<Parameter> find_numbered(const NumberedSpec& facts, std::string_view name) {
  if (!name.starts_with(facts.prefix)) return std::nullopt;
  const std::string_view digits = name.substr(facts.prefix.size());
  if (!all_digits(digits)) return std::nullopt;
  const auto number = parse_unsigned(digits, facts.to);
  if (!number || *number < facts.from) return std::nullopt;
  return make_numbered(facts, static_cast<std::uint16_t>(*number));
}

/// The names that are near, or all of them.
Remedy remedy_for_name(const Profile& profile, std::string_view name) {
  if (all_digits(name)) return {std::string(name), fmt::format("@holding:{}", name)};
  return remedy_for(name, names_of(profile.parameters), "spindle list TARGET");
}

/// "p900" deserves the numbers that exist rather than a similar name.
std::string hint_for(const Profile& profile, std::string_view name) {
  if (profile.numbered && name.starts_with(profile.numbered->prefix) &&
      all_digits(name.substr(profile.numbered->prefix.size()))) {
    return fmt::format("numbers go from {0}{1} to {0}{2}", profile.numbered->prefix,
                       profile.numbered->from, profile.numbered->to);
  }
  if (std::string hint = hint_for_document_number(name); !hint.empty()) return hint;
  if (all_digits(name)) return fmt::format("a raw register is written @holding:{}", name);
  return suggestion(name, names_of(profile.parameters));
}

bool covers(const Parameter& parameter, RegisterTable table, std::uint16_t address) {
  const std::uint16_t first = parameter.address.value;
  return parameter.table == table && address >= first &&
         address - first < register_count(parameter.encoding);
}

bool every_register_writable(const Profile& profile, const Parameter& raw) {
  const std::uint16_t count = register_count(raw.encoding);
  for (std::uint16_t i = 0; i < count; ++i) {
    const auto address = static_cast<std::uint16_t>(raw.address.value + i);
    if (!profile.writable(raw.table, RegisterAddress{address})) return false;
  }
  return true;
}

Result<Parameter> find_raw(const Profile& profile, Result<Parameter> raw) {
  if (raw && raw->encoding.word_order == WordOrder::big) {
    raw->encoding.word_order = profile.link.word_order;
  }
  if (raw) raw->encoding.byte_order = profile.link.byte_order;
  if (raw) raw = profile.marked(*std::move(raw));
  if (raw && modbus::is_writable(raw->table) && every_register_writable(profile, *raw)) {
    raw->access = Access::read_write;
  }
  return raw;
}

std::vector<Parameter> match_named(const Profile& profile, std::string_view pattern) {
  std::vector<Parameter> found;
  for (const Parameter& parameter : profile.parameters) {
    if (glob_match(pattern, parameter.name)) found.push_back(profile.marked(parameter));
  }
  return found;
}

std::vector<Parameter> match_numbered(const Profile& profile, std::string_view pattern) {
  const NumberedSpec& facts = *profile.numbered;
  std::vector<Parameter> found;
  for (unsigned number = facts.from; number <= facts.to; ++number) {
    Parameter parameter = make_numbered(facts, static_cast<std::uint16_t>(number));
    if (!glob_match(pattern, parameter.name)) continue;
    found.push_back(profile.marked(std::move(parameter)));
  }
  return found;
}

/// "f32", "text16" (so many bytes), "bcd4" (likewise); "-le" behind it: the low word comes first.
/// Empty when it is none that can stand alone.
std::optional<Encoding> raw_encoding(std::string_view text) {
  Encoding encoding;
  constexpr std::string_view low_first = "-le";
  if (text.ends_with(low_first)) {
    text.remove_suffix(low_first.size());
    encoding.word_order = WordOrder::little;
  }
  if (const auto kind = kind_words.find(text)) {
    encoding.kind = *kind;
    const bool needs_more = *kind == Kind::text || *kind == Kind::bcd || *kind == Kind::u8 ||
                            *kind == Kind::i8 || *kind == Kind::date;
    if (needs_more) return std::nullopt;
    return encoding;
  }
  constexpr std::uint64_t longest = 2 * modbus::max_read_count;
  for (const Kind kind : {Kind::text, Kind::bcd}) {
    const std::string_view word = to_text(kind);
    if (!text.starts_with(word)) continue;
    const auto length = parse_unsigned(text.substr(word.size()), longest);
    const bool is_too_long = kind == Kind::bcd && length > longest_bcd;
    if (!length || *length == 0 || is_too_long) return std::nullopt;
    encoding.kind = kind;
    encoding.length = static_cast<std::uint16_t>(*length);
    return encoding;
  }
  return std::nullopt;
}

/// "@holding:0..31" as one register after the other; empty when it is no such range.
std::vector<std::string> raw_range(std::string_view text) {
  const std::size_t colon = text.find(':');
  const std::size_t dots = text.find("..");
  if (!text.starts_with('@') || colon == std::string_view::npos || dots == std::string_view::npos) {
    return {};
  }
  const std::size_t slash = std::min(text.find('/'), text.size());
  const auto first = parse_unsigned(text.substr(colon + 1, dots - colon - 1), last_register);
  const auto last = parse_unsigned(text.substr(dots + 2, slash - dots - 2), last_register);
  if (!first || !last || *last < *first) return {};
  const std::string_view kind = text.substr(slash);
  const auto encoding = kind.empty() ? std::optional(Encoding()) : raw_encoding(kind.substr(1));
  const std::uint64_t step = encoding ? register_count(*encoding) : 1U;
  std::vector<std::string> names;
  for (std::uint64_t address = *first; address <= *last; address += step) {
    names.push_back(fmt::format("{}{}{}", text.substr(0, colon + 1), address, kind));
  }
  return names;
}

/// "control.start": one bit of a register, or some, by the name that the profile gives them.
std::optional<Result<Parameter>> find_bit(const Profile& profile, std::string_view name) {
  for (const Parameter& parameter : profile.parameters) {
    const std::string& whole = parameter.name;
    const bool begins =
        name.size() > whole.size() + 1 && name.starts_with(whole) && name[whole.size()] == '.';
    if (!begins || parameter.bits.empty()) continue;
    for (const BitName& bit : parameter.bits) {
      if (!same_ignoring_case(bit.text, name.substr(whole.size() + 1))) continue;
      if (!bit.when) return part_of(parameter, bit);
      Parameter part = parameter;
      part.name = fmt::format("{}.{}", whole, bit.text);
      part.title = fmt::format("{}: {}", parameter.title, bit.text);
      part.part = bit.text;
      return part;
    }
  }
  return std::nullopt;
}

/// Whether a parameter is looked up to be read, or only to be shown.
enum class Purpose : std::uint8_t { reading, description };

Result<Parameter> find_any(const Profile& profile, std::string_view name) {
  if (auto raw = parse_raw_register(name)) return find_raw(profile, std::move(*raw));
  for (const Parameter& parameter : profile.parameters) {
    if (parameter.name == name) return profile.marked(parameter);
  }
  if (profile.numbered) {
    auto found = find_numbered(*profile.numbered, name);
    if (found) return profile.marked(*std::move(found));
  }
  if (auto bit = find_bit(profile, name)) {
    return std::move(*bit).map([&](Parameter part) { return profile.marked(std::move(part)); });
  }
  Error error = unknown(name, fmt::format("no such parameter in profile {}", profile.id),
                        hint_for(profile, name));
  error.remedy = remedy_for_name(profile, name);
  return tl::unexpected(std::move(error));
}

void leave_out_unreadable(const Profile& profile, std::vector<Parameter>& parameters) {
  std::erase_if(parameters, [&](const Parameter& one) {
    const bool is_of_events = profile.events && profile.events->form_of(one) != nullptr;
    return is_of_events || profile.consumes(one);
  });
}

Result<std::vector<Parameter>> expand(const Profile& profile, std::string_view name,
                                      Purpose purpose) {
  if (const auto range = raw_range(name); !range.empty()) {
    std::vector<Parameter> parameters;
    for (const std::string& one : range) {
      TRY_LET(auto found, purpose == Purpose::reading ? profile.find(one) : find_any(profile, one));
      parameters.push_back(std::move(found));
    }
    return parameters;
  }
  if (!is_pattern(name)) {
    TRY_LET(auto one, purpose == Purpose::reading ? profile.find(name) : find_any(profile, name));
    return std::vector<Parameter>{std::move(one)};
  }
  auto found = match_named(profile, name);
  if (found.empty() && profile.numbered) found = match_numbered(profile, name);
  if (purpose == Purpose::reading) leave_out_unreadable(profile, found);
  if (found.empty()) {
    Error error = unknown(name, fmt::format("matches no parameter of profile {}", profile.id), {});
    error.remedy.right = "spindle list TARGET";
    return tl::unexpected(std::move(error));
  }
  return found;
}

Result<std::vector<Parameter>> select_for(const Profile& profile,
                                          const std::vector<std::string>& names, Purpose purpose) {
  std::vector<Parameter> selected;
  if (names.empty()) {
    selected.assign(profile.parameters.begin(), profile.parameters.end());
    if (purpose == Purpose::reading) leave_out_unreadable(profile, selected);
  }
  std::unordered_set<std::string> seen;
  for (const std::string& name : names) {
    TRY_LET(auto found, expand(profile, name, purpose));
    for (Parameter& parameter : found) {
      if (seen.insert(parameter.name).second) selected.push_back(std::move(parameter));
    }
  }
  return selected;
}

Error bad_raw_register(std::string_view text) {
  if (std::string hint = hint_for_document_number(text); !hint.empty()) {
    return unknown(text, "not a raw register", std::move(hint));
  }
  return unknown(
      text, "not a raw register",
      "write @holding:2, @coil:5, @input:3204/i16, @holding:4/f32, @holding:10/text16 or "
      "@holding:0..31");
}

Result<Parameter> parse_raw(std::string_view text) {
  const std::string_view body = text.substr(1);
  const std::size_t colon = body.find(':');
  if (colon == std::string_view::npos) return tl::unexpected(bad_raw_register(text));
  const auto table = modbus::table_words.find(body.substr(0, colon));
  const std::string_view rest = body.substr(colon + 1);
  const std::size_t slash = rest.find('/');
  const auto address = parse_unsigned(rest.substr(0, slash), last_register);
  if (!table || !address) return tl::unexpected(bad_raw_register(text));
  const bool is_bit = modbus::holds_bits(*table);
  const auto encoding = slash == std::string_view::npos
                            ? std::optional(Encoding{.kind = is_bit ? Kind::bit : Kind::u16})
                            : raw_encoding(rest.substr(slash + 1));
  if (!encoding || (is_bit && encoding->kind != Kind::bit)) {
    return tl::unexpected(bad_raw_register(text));
  }
  if (*address + register_count(*encoding) - 1 > last_register) {
    return tl::unexpected(
        unknown(text, "a value of this length does not fit behind the last register", {}));
  }
  std::string name = fmt::format("@{}:{}", to_text(*table), *address);
  if (slash != std::string_view::npos && rest.substr(slash + 1) != "u16") {
    name += rest.substr(slash);
  }
  return Parameter{.name = std::move(name),
                   .title = "Raw register",
                   .table = *table,
                   .address = {static_cast<std::uint16_t>(*address)},
                   .encoding = *encoding,
                   .unit = {},
                   .source = "register given by the user",
                   .note = {}};
}

/// A writable parameter of which a write to these registers would change only a part.
const Parameter* torn_by(const Profile& profile, RegisterTable table, unsigned first,
                         std::size_t count) {
  const auto is_torn = [&](const Parameter& parameter) {
    if (parameter.access != Access::read_write || parameter.table != table) return false;
    const unsigned begin = parameter.written_at().value;
    const unsigned end = begin + static_cast<unsigned>(register_count(parameter.encoding));
    const bool shares = first < end && begin < first + count;
    const bool holds_all = first <= begin && end <= first + count;
    return shares && !holds_all;
  };
  const auto found = std::find_if(profile.parameters.begin(), profile.parameters.end(), is_torn);
  return found == profile.parameters.end() ? nullptr : &*found;
}

/// Whether a writable parameter, an action, or the arming of events has this register.
bool is_listed(const Profile& profile, RegisterTable table, RegisterAddress address) {
  const auto holds = [&](RegisterTable at, unsigned first, unsigned count) {
    return at == table && address.value >= first && address.value < first + count;
  };
  const bool arms = profile.events && profile.events->arm &&
                    holds(RegisterTable::holding, profile.events->arm->address, 1);
  const auto acts = [&](const Action& action) {
    const bool prepares =
        action.prepare && holds(RegisterTable::holding, action.prepare->address.value, 1);
    return prepares || holds(action.table, action.address.value, register_count(action.encoding));
  };
  const auto takes = [&](const Parameter& parameter) {
    return parameter.access == Access::read_write &&
           holds(parameter.table, parameter.written_at().value, register_count(parameter.encoding));
  };
  const auto& numbered = profile.numbered;
  const bool has_number = numbered && numbered->table == table &&
                          numbered->access == Access::read_write &&
                          address.value >= numbered->from && address.value <= numbered->to;
  return arms || has_number ||
         std::any_of(profile.parameters.begin(), profile.parameters.end(), takes) ||
         std::any_of(profile.actions.begin(), profile.actions.end(), acts);
}

}  // namespace

std::optional<Duration> SerialSpec::gap_at(unsigned baud) const {
  for (const GapRule& rule : gaps) {
    if (rule.up_to_baud == 0 || baud <= rule.up_to_baud) return rule.gap;
  }
  return std::nullopt;
}

Result<void> check_pair(const Encoding& encoding, const LinkSpec& link) {
  if (!link.even_pairs || register_count(encoding) <= link.max_write) return {};
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = "it cannot be written: by its profile a value of 32 bits is never split "
                       "('pairs: even'), and a write takes one register ('max-write: 1')",
            .hint = "a profile with 'pairs: any' writes the two words one after the other"});
}

modbus::RegisterTable table_of(const EventSpec& events) {
  constexpr auto input = static_cast<std::uint8_t>(modbus::FunctionCode::read_input_registers);
  return events.function == input ? modbus::RegisterTable::input : modbus::RegisterTable::holding;
}

bool EventSpec::has_form(std::size_t registers) const {
  return registers == count || std::any_of(longer.begin(), longer.end(), [&](const auto& form) {
           return form.count == registers;
         });
}

std::uint16_t EventSpec::count_for(unsigned firmware) const {
  std::uint16_t most = count;
  for (const EventForm& form : longer) {
    if (form.firmware_from != 0 && firmware >= form.firmware_from)
      most = std::max(most, form.count);
  }
  return most;
}

const EventForm* EventSpec::form_of(const Parameter& parameter) const {
  if (parameter.table != table_of(*this)) return nullptr;
  const auto* const form = std::find_if(longer.begin(), longer.end(), [&](const auto& each) {
    return glob_match(each.parameters, parameter.name);
  });
  return form == longer.end() ? nullptr : &*form;
}

bool ExtendedErrorSpec::is_busy(std::int64_t code) const {
  return std::find(busy.begin(), busy.end(), code) != busy.end();
}

Result<Parameter> Profile::find(std::string_view name) const {
  auto found = find_any(*this, name);
  if (!found) return found;
  return may_read(*found).map([&] { return *std::move(found); });
}

Result<void> Profile::may_read(const Parameter& parameter) const {
  if (events && events->form_of(parameter) != nullptr) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "where it stands differs from tool to tool, and only an event tells",
              .hint = "'spindle watch' shows it with the event",
              .name = parameter.name});
  }
  for (const Parameter& named : parameters) {
    if (named.reading != Reading::consumes || !share_registers(named, parameter)) continue;
    if (events && events->flag == named.name) {
      return tl::unexpected(
          Error{.code = Errc::usage,
                .message = "reading it clears it, and the result that it tells of would be lost",
                .hint = "'spindle watch' reads it, and the result behind it",
                .name = parameter.name});
    }
    if (named.name == parameter.name) continue;
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = fmt::format("reading it clears {}", named.name),
                                .hint = fmt::format("'{}' is read when it is named", named.name),
                                .name = parameter.name});
  }
  return {};
}

Result<std::vector<Parameter>> Profile::select(const std::vector<std::string>& names) const {
  return select_for(*this, names, Purpose::reading);
}

Result<std::vector<Parameter>> Profile::describe(const std::vector<std::string>& names) const {
  return select_for(*this, names, Purpose::description);
}

bool Profile::consumes(const Parameter& parameter) const {
  return std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& named) {
    return named.reading == Reading::consumes && share_registers(named, parameter);
  });
}

Parameter Profile::numbered_parameter(std::uint16_t number) const {
  return marked(make_numbered(*numbered, number));
}

Parameter Profile::marked(Parameter parameter) const {
  for (const Parameter& named : parameters) {
    const bool is_mark = named.secrecy == Secrecy::secret || named.guarding == Guarding::alone;
    if (!is_mark || !share_registers(named, parameter)) continue;
    if (named.secrecy == Secrecy::secret) parameter.secrecy = Secrecy::secret;
    if (named.guarding == Guarding::alone) parameter.guarding = Guarding::alone;
  }
  return parameter;
}

bool Profile::has_guarded() const {
  return std::any_of(parameters.begin(), parameters.end(), [](const Parameter& parameter) {
    return parameter.guarding == Guarding::alone;
  });
}

Result<void> Profile::may_write(RegisterTable table, RegisterAddress first,
                                std::size_t count) const {
  if (writes == Writes::any) return {};
  for (std::size_t i = 0; i < count; ++i) {
    const RegisterAddress address{static_cast<std::uint16_t>(first.value + i)};
    if (is_listed(*this, table, address)) continue;
    return tl::unexpected(
        Error{.code = Errc::read_only,
              .message = fmt::format("profile {} allows no write to {} {}: no public "
                                     "documentation says what it does",
                                     id, to_text(table), address.value),
              .hint = "'spindle list' and 'spindle do' show what can be written",
              .register_address = address.value});
  }
  if (const Parameter* torn = torn_by(*this, table, first.value, count)) {
    return tl::unexpected(Error{
        .code = Errc::usage,
        .message = fmt::format("this is a part of {}, whose {} registers are written together",
                               torn->name, register_count(torn->encoding)),
        .hint = fmt::format("set {} itself", torn->name),
        .register_address = first.value});
  }
  return {};
}

Result<Action> Profile::find_action(std::string_view name) const {
  for (const Action& action : actions) {
    if (action.name == name) return action;
  }
  std::string hint = suggestion(name, names_of(actions));
  if (hint.empty()) hint = "'spindle do TARGET' lists the actions";
  Error error = unknown(name, fmt::format("no such action in profile {}", id), std::move(hint));
  error.remedy = remedy_for(name, names_of(actions), "spindle do TARGET");
  return tl::unexpected(std::move(error));
}

bool Profile::is_guarded_start(std::string_view action) const {
  if (!run || run->is_derived) return false;
  if (const StartActionSpec* facts = run->action()) return facts->start == action;
  const auto found = std::find_if(actions.begin(), actions.end(),
                                  [action](const Action& each) { return each.name == action; });
  return found != actions.end() && found->motion == Motion::start;
}

bool Profile::writable(RegisterTable table, RegisterAddress address) const {
  const std::uint16_t wanted = address.value;
  const bool by_number = numbered && numbered->table == table &&
                         numbered->access == Access::read_write && wanted >= numbered->from &&
                         wanted <= numbered->to;
  return by_number ||
         std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& parameter) {
           return parameter.access == Access::read_write && covers(parameter, table, wanted);
         });
}

std::optional<Profile::LimitRegisters> Profile::limit_registers(const Parameter& parameter) const {
  const std::uint16_t number = parameter.address.value;
  const bool has_limits = limits && parameter.table == RegisterTable::holding &&
                          register_count(parameter.encoding) == 1 && number >= limits->from &&
                          number <= limits->to;
  if (!has_limits) return std::nullopt;
  const auto mirror = [number](std::uint16_t offset) {
    return RegisterAddress{static_cast<std::uint16_t>(number + offset)};
  };
  return LimitRegisters{mirror(limits->minimum_offset), mirror(limits->maximum_offset)};
}

std::string name_of(const EventSetting& setting, std::int64_t preset) {
  constexpr std::string_view place = "{n}";
  std::string name = setting.parameter.to_string();
  const auto at = name.find(place);
  if (at != std::string::npos) name.replace(at, place.size(), std::to_string(preset));
  return name;
}

bool sends_unasked(const Profile& profile) {
  return profile.events && profile.events->model == EventModel::push;
}

Judgement judge(const Profile& profile, const Identity& identity) {
  switch (generation_of(*profile.identity, identity)) {
    case Generation::unknown:
      return Judgement::unknown;
    case Generation::earlier:
      return Judgement::earlier;
    case Generation::later:
      return Judgement::later;
    case Generation::known:
      break;
  }
  const std::string& product = identity.product_profile;
  const auto is = [&](std::string_view id) {
    return profile.id == id ||
           std::find(profile.bases.begin(), profile.bases.end(), id) != profile.bases.end();
  };
  const auto& products = profile.identity->products;
  const bool is_another = std::any_of(products.begin(), products.end(),
                                      [&](const auto& entry) { return is(entry.value); });
  return product.empty() || is(product) || !is_another ? Judgement::fits : Judgement::other_product;
}

std::string misfit(const Profile& profile, const Identity& identity) {
  switch (judge(profile, identity)) {
    case Judgement::later:
      return fmt::format("firmware {} has another register map than {} (below {})",
                         identity.firmware.value_or(0), profile.id,
                         profile.identity->firmware_below);
    case Judgement::earlier:
      return fmt::format("firmware {} has another register map than {} (from {})",
                         identity.firmware.value_or(0), profile.id,
                         profile.identity->firmware_from);
    case Judgement::other_product:
      return fmt::format("the serial number is that of a {}, not of a {}", identity.product_profile,
                         profile.id);
    case Judgement::unknown:
    case Judgement::fits:
      break;
  }
  return "this is not the identity of any known product";
}

std::optional<Result<Parameter>> parse_raw_register(std::string_view text) {
  if (!text.starts_with('@')) return std::nullopt;
  return parse_raw(text);
}

}  // namespace spindle::catalogue
