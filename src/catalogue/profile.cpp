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
         address - first < register_count(parameter.encoding.kind);
}

bool every_register_writable(const Profile& profile, const Parameter& raw) {
  const std::uint16_t count = register_count(raw.encoding.kind);
  for (std::uint16_t i = 0; i < count; ++i) {
    const auto address = static_cast<std::uint16_t>(raw.address.value + i);
    if (!profile.writable(RegisterAddress{address})) return false;
  }
  return true;
}

bool overlap(const Parameter& one, const Parameter& other) {
  const auto end = [](const Parameter& parameter) {
    return parameter.address.value + register_count(parameter.encoding.kind);
  };
  return one.table == other.table && one.address.value < end(other) &&
         other.address.value < end(one);
}

Result<Parameter> find_raw(const Profile& profile, Result<Parameter> raw) {
  if (raw) raw = profile.with_secrecy(*std::move(raw));
  if (raw && raw->table == RegisterTable::holding && every_register_writable(profile, *raw)) {
    raw->access = Access::read_write;
  }
  return raw;
}

std::vector<Parameter> match_named(const Profile& profile, std::string_view pattern) {
  std::vector<Parameter> found;
  for (const Parameter& parameter : profile.parameters) {
    if (glob_match(pattern, parameter.name)) found.push_back(profile.with_secrecy(parameter));
  }
  return found;
}

std::vector<Parameter> match_numbered(const Profile& profile, std::string_view pattern) {
  const NumberedSpec& facts = *profile.numbered;
  std::vector<Parameter> found;
  for (unsigned number = facts.from; number <= facts.to; ++number) {
    Parameter parameter = make_numbered(facts, static_cast<std::uint16_t>(number));
    if (!glob_match(pattern, parameter.name)) continue;
    found.push_back(profile.with_secrecy(std::move(parameter)));
  }
  return found;
}

/// Whether a parameter is looked up to be read, or only to be shown.
enum class Purpose : std::uint8_t { reading, description };

Result<Parameter> find_any(const Profile& profile, std::string_view name) {
  if (auto raw = parse_raw_register(name)) return find_raw(profile, std::move(*raw));
  for (const Parameter& parameter : profile.parameters) {
    if (parameter.name == name) return profile.with_secrecy(parameter);
  }
  if (profile.numbered) {
    auto found = find_numbered(*profile.numbered, name);
    if (found) return profile.with_secrecy(*std::move(found));
  }
  return tl::unexpected(unknown(name, fmt::format("no such parameter in profile {}", profile.id),
                                hint_for(profile, name)));
}

void leave_out_consumed(const Profile& profile, std::vector<Parameter>& parameters) {
  std::erase_if(parameters, [&](const Parameter& one) { return profile.consumes(one); });
}

Result<std::vector<Parameter>> expand(const Profile& profile, std::string_view name,
                                      Purpose purpose) {
  if (!is_pattern(name)) {
    auto one = purpose == Purpose::reading ? profile.find(name) : find_any(profile, name);
    if (!one) return tl::unexpected(std::move(one.error()));
    return std::vector<Parameter>{std::move(*one)};
  }
  auto found = match_named(profile, name);
  if (found.empty() && profile.numbered) found = match_numbered(profile, name);
  if (purpose == Purpose::reading) leave_out_consumed(profile, found);
  if (found.empty()) {
    return tl::unexpected(
        unknown(name, fmt::format("matches no parameter of profile {}", profile.id), {}));
  }
  return found;
}

Result<std::vector<Parameter>> select_for(const Profile& profile,
                                          const std::vector<std::string>& names, Purpose purpose) {
  std::vector<Parameter> selected;
  if (names.empty()) {
    selected.assign(profile.parameters.begin(), profile.parameters.end());
    if (purpose == Purpose::reading) leave_out_consumed(profile, selected);
  }
  std::unordered_set<std::string> seen;
  for (const std::string& name : names) {
    auto found = expand(profile, name, purpose);
    if (!found) return tl::unexpected(std::move(found.error()));
    for (Parameter& parameter : *found) {
      if (seen.insert(parameter.name).second) selected.push_back(std::move(parameter));
    }
  }
  return selected;
}

Error bad_raw_register(std::string_view text) {
  if (std::string hint = hint_for_document_number(text); !hint.empty()) {
    return unknown(text, "not a raw register", std::move(hint));
  }
  return unknown(text, "not a raw register",
                 fmt::format("write @holding:2 or @input:3204/i16, with {} behind the slash",
                             kind_words.alternatives()));
}

Result<Parameter> parse_raw(std::string_view text) {
  const std::string_view body = text.substr(1);
  const std::size_t colon = body.find(':');
  if (colon == std::string_view::npos) return tl::unexpected(bad_raw_register(text));
  const auto table = modbus::table_words.find(body.substr(0, colon));
  const std::string_view rest = body.substr(colon + 1);
  const std::size_t slash = rest.find('/');
  const auto address = parse_unsigned(rest.substr(0, slash), last_register);
  const auto kind = slash == std::string_view::npos ? std::optional(Kind::u16)
                                                    : kind_words.find(rest.substr(slash + 1));
  if (!table || !address || !kind) return tl::unexpected(bad_raw_register(text));
  if (*address + register_count(*kind) - 1 > last_register) {
    return tl::unexpected(
        unknown(text, "a 32-bit value does not fit behind the last register", {}));
  }
  std::string name = fmt::format("@{}:{}", to_text(*table), *address);
  if (*kind != Kind::u16) name += fmt::format("/{}", to_text(*kind));
  return Parameter{.name = std::move(name),
                   .title = "Raw register",
                   .table = *table,
                   .address = {static_cast<std::uint16_t>(*address)},
                   .encoding = {.kind = *kind},
                   .unit = {},
                   .source = "register given by the user",
                   .note = {}};
}

}  // namespace

std::optional<Duration> SerialSpec::gap_at(unsigned baud) const {
  for (const GapRule& rule : gaps) {
    if (rule.up_to_baud == 0 || baud <= rule.up_to_baud) return rule.gap;
  }
  return std::nullopt;
}

Result<void> check_pair(Kind kind, const LinkSpec& link) {
  if (!link.even_pairs || register_count(kind) <= link.max_write) return {};
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

bool ExtendedErrorSpec::is_busy(std::int64_t code) const {
  return std::find(busy.begin(), busy.end(), code) != busy.end();
}

Result<Parameter> Profile::find(std::string_view name) const {
  auto found = find_any(*this, name);
  if (!found || !consumes(*found)) return found;
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = "reading it clears it, and the result that it tells of would be lost",
            .hint = "'spindle watch' reads it, and the result behind it",
            .name = std::string(name)});
}

Result<std::vector<Parameter>> Profile::select(const std::vector<std::string>& names) const {
  return select_for(*this, names, Purpose::reading);
}

Result<std::vector<Parameter>> Profile::describe(const std::vector<std::string>& names) const {
  return select_for(*this, names, Purpose::description);
}

bool Profile::consumes(const Parameter& parameter) const {
  return std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& named) {
    return named.reading == Reading::consumes && overlap(named, parameter);
  });
}

Parameter Profile::numbered_parameter(std::uint16_t number) const {
  return with_secrecy(make_numbered(*numbered, number));
}

Parameter Profile::with_secrecy(Parameter parameter) const {
  const bool holds_secret =
      std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& named) {
        return named.secrecy == Secrecy::secret && overlap(named, parameter);
      });
  if (holds_secret) parameter.secrecy = Secrecy::secret;
  return parameter;
}

Result<Action> Profile::find_action(std::string_view name) const {
  for (const Action& action : actions) {
    if (action.name == name) return action;
  }
  std::string hint = suggestion(name, names_of(actions));
  if (hint.empty()) hint = "'spindle do TARGET' lists the actions";
  return tl::unexpected(
      unknown(name, fmt::format("no such action in profile {}", id), std::move(hint)));
}

bool Profile::is_guarded_start(std::string_view action) const {
  if (!run || run->is_derived) return false;
  if (const StartActionSpec* facts = run->action()) return facts->start == action;
  const auto found = std::find_if(actions.begin(), actions.end(),
                                  [action](const Action& each) { return each.name == action; });
  return found != actions.end() && found->motion == Motion::start;
}

bool Profile::writable(RegisterAddress address) const {
  const std::uint16_t wanted = address.value;
  const bool by_number = numbered && numbered->table == RegisterTable::holding &&
                         numbered->access == Access::read_write && wanted >= numbered->from &&
                         wanted <= numbered->to;
  return by_number ||
         std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& parameter) {
           return parameter.access == Access::read_write &&
                  covers(parameter, RegisterTable::holding, wanted);
         });
}

std::optional<Profile::LimitRegisters> Profile::limit_registers(const Parameter& parameter) const {
  const std::uint16_t number = parameter.address.value;
  const bool has_limits = limits && parameter.table == RegisterTable::holding &&
                          register_count(parameter.encoding.kind) == 1 && number >= limits->from &&
                          number <= limits->to;
  if (!has_limits) return std::nullopt;
  const auto mirror = [number](std::uint16_t offset) {
    return RegisterAddress{static_cast<std::uint16_t>(number + offset)};
  };
  return LimitRegisters{mirror(limits->minimum_offset), mirror(limits->maximum_offset)};
}

bool sends_unasked(const Profile& profile) {
  return profile.events && profile.events->model == EventModel::push;
}

Judgement judge(const Profile& profile, const Identity& identity) {
  switch (generation_of(*profile.identity, identity)) {
    case Generation::unknown:
      return Judgement::unknown;
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
