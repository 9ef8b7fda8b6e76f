#include "spindle/link/endpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "spindle/base/duration.hpp"
#include "spindle/base/enum_table.hpp"
#include "spindle/base/text.hpp"

namespace spindle::link {
namespace {

constexpr std::uint8_t max_serial_unit = 247;  // Modbus over Serial Line 1.02, 2.2

Error bad_target(std::string_view url, std::string message, std::string hint = {}) {
  return Error{.code = Errc::bad_target,
               .message = std::move(message),
               .hint = std::move(hint),
               .target = std::string(url)};
}

struct Scheme {
  std::string_view name;
  Medium medium;
  std::string_view form;
};

constexpr std::array<Scheme, 4> schemes = {{
    {"tcp", Medium::tcp, "tcp://HOST[:PORT][?unit=N]"},
    {"rtu", Medium::serial, "rtu:///dev/ttyUSB0?unit=1"},
    {"rtu+tcp", Medium::rtu_over_tcp, "rtu+tcp://HOST:PORT?unit=1"},
    {"sim", Medium::simulated, "sim:PROFILE"},
}};

std::vector<std::string> scheme_names() {
  std::vector<std::string> names;
  names.reserve(schemes.size());
  for (const Scheme& scheme : schemes) names.emplace_back(scheme.name);
  return names;
}

struct Parts {
  const Scheme* scheme;
  std::string_view body;   ///< between "scheme:" and '?'
  std::string_view query;  ///< behind '?'
};

Result<Parts> take_apart(std::string_view url) {
  const std::string forms =
      "a target is tcp://HOST, rtu:///DEVICE, rtu+tcp://HOST:PORT or sim:PROFILE";
  const auto colon = url.find(':');
  if (colon == std::string_view::npos) {
    return tl::unexpected(bad_target(url, "the ':' of a URL is missing", forms));
  }
  const std::string_view name = url.substr(0, colon);
  for (const Scheme& scheme : schemes) {
    if (scheme.name != name) continue;
    const std::string_view rest = url.substr(colon + 1);
    const auto question = rest.find('?');
    return Parts{
        &scheme, rest.substr(0, question),
        question == std::string_view::npos ? std::string_view() : rest.substr(question + 1)};
  }
  std::string hint = suggestion(name, scheme_names());
  if (hint.empty()) hint = forms;
  Error error = bad_target(url, fmt::format("unknown kind of target '{}:'", name), hint);
  if (const auto meant = closest(name, scheme_names())) {
    error.remedy = {std::string(url), std::string(url).replace(0, colon, *meant)};
  }
  return tl::unexpected(std::move(error));
}

Result<void> parse_port(Endpoint& endpoint, std::string_view text) {
  const auto port = parse_unsigned(text, 65535);
  if (!port || *port == 0) {
    return tl::unexpected(
        bad_target(endpoint.text, fmt::format("'{}' is not a port (1 to 65535)", text)));
  }
  endpoint.port = static_cast<std::uint16_t>(*port);
  return {};
}

bool is_host_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '_';
}

bool is_address_character(char c) {
  return std::isxdigit(static_cast<unsigned char>(c)) != 0 || c == ':' || c == '.';
}

/// By its characters only; the resolver knows the rest. A zone may stand behind '%'.
bool is_ipv6_address(std::string_view host) {
  const auto percent = host.find('%');
  const std::string_view address = host.substr(0, percent);
  if (address.find(':') == std::string_view::npos) return false;
  if (!std::all_of(address.begin(), address.end(), is_address_character)) return false;
  if (percent == std::string_view::npos) return true;
  const std::string_view zone = host.substr(percent + 1);
  return !zone.empty() && std::all_of(zone.begin(), zone.end(), is_host_character);
}

Result<void> parse_bracketed_host(Endpoint& endpoint, std::string_view authority) {
  const auto bracket = authority.find(']');
  if (bracket == std::string_view::npos) {
    return tl::unexpected(
        bad_target(endpoint.text, "the bracket of the IPv6 address is not closed"));
  }
  endpoint.host = authority.substr(1, bracket - 1);
  if (!endpoint.host.empty() && !is_ipv6_address(endpoint.host)) {
    return tl::unexpected(
        bad_target(endpoint.text, fmt::format("'{}' is not an IPv6 address", endpoint.host)));
  }
  const std::string_view rest = authority.substr(bracket + 1);
  if (rest.empty()) return {};
  if (rest.front() != ':') {
    return tl::unexpected(
        bad_target(endpoint.text, fmt::format("'{}' behind the IPv6 address is not a port", rest)));
  }
  return parse_port(endpoint, rest.substr(1));
}

Result<void> parse_plain_host(Endpoint& endpoint, std::string_view authority) {
  const auto colon = authority.find(':');
  endpoint.host = authority.substr(0, colon);
  if (authority.find(':', colon + 1) != std::string_view::npos && colon != std::string_view::npos) {
    return tl::unexpected(
        bad_target(endpoint.text, "more than one ':' in the host",
                   "an IPv6 address stands in brackets, such as tcp://[::1]:5000"));
  }
  for (const char c : endpoint.host) {
    if (!is_host_character(c)) {
      return tl::unexpected(bad_target(
          endpoint.text, fmt::format("'{}' is not a host name or address", endpoint.host)));
    }
  }
  return colon == std::string_view::npos ? Result<void>()
                                         : parse_port(endpoint, authority.substr(colon + 1));
}

Result<void> parse_network(Endpoint& endpoint, std::string_view body, const Scheme& scheme) {
  if (!body.starts_with("//")) {
    return tl::unexpected(
        bad_target(endpoint.text, "'//' is missing", fmt::format("write {}", scheme.form)));
  }
  std::string_view authority = body.substr(2);
  if (authority.ends_with('/')) authority.remove_suffix(1);
  const bool bracketed = authority.starts_with('[');
  auto parsed =
      bracketed ? parse_bracketed_host(endpoint, authority) : parse_plain_host(endpoint, authority);
  if (!parsed) return parsed;
  if (endpoint.host.empty()) {
    return tl::unexpected(
        bad_target(endpoint.text, "the host is missing", fmt::format("write {}", scheme.form)));
  }
  if (endpoint.medium == Medium::rtu_over_tcp && !endpoint.port) {
    return tl::unexpected(bad_target(endpoint.text, "the port of the device server is missing",
                                     fmt::format("write {}", scheme.form)));
  }
  return {};
}

Result<void> parse_serial(Endpoint& endpoint, std::string_view body, const Scheme& scheme) {
  if (body.starts_with("//")) body.remove_prefix(2);
  if (!body.starts_with('/') || body.size() == 1) {
    const bool relative = body.size() > 1;
    return tl::unexpected(bad_target(endpoint.text,
                                     relative ? "the path of a serial line begins with '/'"
                                              : "the path of the serial line is missing",
                                     fmt::format("write {}", scheme.form)));
  }
  endpoint.device = body;
  return {};
}

Result<void> parse_simulated(Endpoint& endpoint, std::string_view body) {
  if (body.starts_with("//")) body.remove_prefix(2);
  if (body.empty()) {
    return tl::unexpected(bad_target(endpoint.text, "the profile of the simulated tool is missing",
                                     "write sim:doga-bm; 'spindle profile list' shows all"));
  }
  endpoint.profile = body;
  return {};
}

Result<void> parse_body(Endpoint& endpoint, const Parts& parts) {
  switch (endpoint.medium) {
    case Medium::serial:
      return parse_serial(endpoint, parts.body, *parts.scheme);
    case Medium::simulated:
      return parse_simulated(endpoint, parts.body);
    case Medium::tcp:
    case Medium::rtu_over_tcp:
      break;
  }
  return parse_network(endpoint, parts.body, *parts.scheme);
}

using Setter = std::function<Result<void>(Endpoint&, std::string_view)>;

struct UrlOption {
  std::string_view name;
  std::vector<Medium> media;  ///< where it means something
  Setter set;
};

Error bad_option(const Endpoint& endpoint, std::string_view name, std::string_view value,
                 std::string_view allowed) {
  return bad_target(endpoint.text, fmt::format("{}={}: {} is {}", name, value, name, allowed));
}

std::uint8_t last_unit(const Endpoint& endpoint) {
  const bool is_rtu = endpoint.medium == Medium::serial || endpoint.medium == Medium::rtu_over_tcp;
  return is_rtu && !endpoint.reserved_units ? max_serial_unit : std::uint8_t{255};
}

Error bad_unit(const Endpoint& endpoint, std::string_view value) {
  return bad_option(endpoint, "unit", value,
                    fmt::format("a number from 0 to {}", last_unit(endpoint)));
}

Result<void> set_unit(Endpoint& endpoint, std::string_view value) {
  const auto unit = parse_unsigned(value, 255);
  if (!unit) return tl::unexpected(bad_unit(endpoint, value));
  endpoint.unit = modbus::UnitId{static_cast<std::uint8_t>(*unit)};
  return {};
}

Result<void> set_baud(Endpoint& endpoint, std::string_view value) {
  const auto baud = parse_unsigned(value, 4'000'000);
  if (!baud || *baud == 0) {
    return tl::unexpected(bad_option(endpoint, "baud", value, "a rate such as 9600 or 115200"));
  }
  endpoint.baud = static_cast<unsigned>(*baud);
  return {};
}

/// One of the words of a table.
template <typename Into, typename E, std::size_t count>
Result<void> set_word(const Endpoint& endpoint, std::string_view name, std::string_view value,
                      const EnumTable<E, count>& words, Into& into) {
  const auto meant = words.find(value);
  if (!meant) return tl::unexpected(bad_option(endpoint, name, value, words.alternatives()));
  into = *meant;
  return {};
}

Result<void> set_parity(Endpoint& endpoint, std::string_view value) {
  return set_word(endpoint, "parity", value, modbus::parity_words, endpoint.parity);
}

Result<void> set_stop(Endpoint& endpoint, std::string_view value) {
  const auto bits = parse_unsigned(value, 2);
  if (!bits || *bits == 0) return tl::unexpected(bad_option(endpoint, "stop", value, "1 or 2"));
  endpoint.stop_bits = static_cast<unsigned>(*bits);
  return {};
}

Result<void> set_gap(Endpoint& endpoint, std::string_view value) {
  const auto gap = parse_duration(value);
  if (!gap || *gap > longest_gap) {
    return tl::unexpected(
        bad_option(endpoint, "gap", value, fmt::format("a time up to {}", to_text(longest_gap))));
  }
  endpoint.gap = *gap;
  return {};
}

Result<void> set_timeout(Endpoint& endpoint, std::string_view value) {
  const auto timeout = parse_duration(value);
  if (!timeout || *timeout <= Duration::zero() || *timeout > longest_timeout) {
    return tl::unexpected(bad_option(endpoint, "timeout", value,
                                     fmt::format("a time up to {}", to_text(longest_timeout))));
  }
  endpoint.timeout = *timeout;
  return {};
}

Result<void> set_retries(Endpoint& endpoint, std::string_view value) {
  const auto retries = parse_unsigned(value, most_retries);
  if (!retries) {
    return tl::unexpected(
        bad_option(endpoint, "retries", value, fmt::format("a number from 0 to {}", most_retries)));
  }
  endpoint.retries = static_cast<unsigned>(*retries);
  return {};
}

Result<void> set_switching(Endpoint& endpoint, std::string_view value) {
  constexpr auto words = enum_table<LineSwitching>(
      {{"true", LineSwitching::kernel}, {"false", LineSwitching::adapter}});
  return set_word(endpoint, "rs485", value, words, endpoint.switching);
}

Result<void> set_echo(Endpoint& endpoint, std::string_view value) {
  constexpr auto words = enum_table<LocalEcho>(
      {{"true", LocalEcho::present}, {"false", LocalEcho::absent}, {"auto", LocalEcho::automatic}});
  return set_word(endpoint, "echo", value, words, endpoint.echo);
}

Result<void> set_reserved(Endpoint& endpoint, std::string_view value) {
  constexpr auto words = enum_table<bool>({{"true", true}, {"false", false}});
  return set_word(endpoint, "reserved", value, words, endpoint.reserved_units);
}

Result<void> set_transaction(Endpoint& endpoint, std::string_view value) {
  return set_word(endpoint, "transaction", value, modbus::transaction_words, endpoint.transactions);
}

/// Whether the unit may be asked for at all; known only when all options are.
Result<void> check_unit(const Endpoint& endpoint) {
  if (!endpoint.unit || endpoint.unit->value <= last_unit(endpoint)) return {};
  Error error = bad_unit(endpoint, std::to_string(endpoint.unit->value));
  error.hint = fmt::format("units from {} are reserved; with &reserved=true they are asked",
                           max_serial_unit + 1);
  return tl::unexpected(std::move(error));
}

const std::vector<UrlOption>& url_options() {
  using enum Medium;
  static const std::vector<UrlOption> options = {
      {"unit", {tcp, serial, rtu_over_tcp, simulated}, set_unit},
      {"transaction", {tcp}, set_transaction},
      {"reserved", {serial, rtu_over_tcp}, set_reserved},
      {"baud", {serial, rtu_over_tcp, simulated}, set_baud},
      {"parity", {serial}, set_parity},
      {"stop", {serial}, set_stop},
      {"gap", {serial, rtu_over_tcp}, set_gap},
      {"timeout", {tcp, serial, rtu_over_tcp, simulated}, set_timeout},
      {"retries", {tcp, serial, rtu_over_tcp, simulated}, set_retries},
      {"rs485", {serial}, set_switching},
      {"echo", {serial, rtu_over_tcp}, set_echo}};
  return options;
}

Result<void> apply_option(Endpoint& endpoint, std::string_view item,
                          std::set<std::string_view>& seen) {
  const auto equals = item.find('=');
  const std::string_view name = item.substr(0, equals);
  std::vector<std::string> names;
  for (const UrlOption& option : url_options()) {
    if (std::find(option.media.begin(), option.media.end(), endpoint.medium) == option.media.end())
      continue;
    names.emplace_back(option.name);
    if (option.name != name) continue;
    if (equals == std::string_view::npos) {
      return tl::unexpected(bad_target(endpoint.text, fmt::format("'{}' has no value", name)));
    }
    if (!seen.insert(option.name).second) {
      return tl::unexpected(bad_target(endpoint.text, fmt::format("'{}' is given twice", name)));
    }
    return option.set(endpoint, item.substr(equals + 1));
  }
  std::string hint = suggestion(name, names);
  if (hint.empty()) hint = fmt::format("here there is {}", fmt::join(names, ", "));
  Error error = bad_target(endpoint.text, fmt::format("unknown option '{}'", name), hint);
  if (const auto meant = closest(name, names)) {
    std::string mended = endpoint.text;
    mended.replace(mended.rfind(name), name.size(), *meant);
    error.remedy = {endpoint.text, std::move(mended)};
  }
  return tl::unexpected(std::move(error));
}

/// Whether it begins with "WORD:".
bool has_scheme(std::string_view text) {
  const auto colon = text.find(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  const std::string_view word = text.substr(0, colon);
  return std::all_of(word.begin(), word.end(), [](char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '+';
  });
}

bool is_known_scheme(std::string_view word) {
  return std::any_of(schemes.begin(), schemes.end(),
                     [&](const Scheme& scheme) { return scheme.name == word; });
}

bool is_number(std::string_view text) { return parse_unsigned(text, 65'535).has_value(); }

bool is_ipv4_address(std::string_view host) {
  const auto bytes = split(host, '.');
  return bytes.size() == 4 && std::all_of(bytes.begin(), bytes.end(), is_number);
}

/// HOST:PORT, an IPv4 address alone, or an IPv6 address in brackets.
bool is_bare_host(std::string_view text) {
  const auto last = text.rfind(':');
  if (text.starts_with('[')) {
    const auto bracket = text.find(']');
    return bracket != std::string_view::npos && is_ipv6_address(text.substr(1, bracket - 1));
  }
  if (last == std::string_view::npos) return is_ipv4_address(text);
  const std::string_view host = text.substr(0, last);
  if (is_known_scheme(host) || !is_number(text.substr(last + 1))) return false;
  return !host.empty() && std::all_of(host.begin(), host.end(), is_host_character);
}

/// Whether a path is one of the devices that are files, streams or memory to a program, and no
/// line: what a shell gives for <(command), too.
bool is_file_device(std::string_view path) {
  constexpr std::string_view folder = "/dev/";
  constexpr std::array<std::string_view, 8> names = {"stdin", "stdout", "stderr", "null",
                                                     "full",  "zero",   "random", "urandom"};
  constexpr std::array<std::string_view, 3> folders = {"fd/", "shm/", "mqueue/"};
  const std::string_view name = path.substr(folder.size());
  return name.empty() || std::find(names.begin(), names.end(), name) != names.end() ||
         std::any_of(folders.begin(), folders.end(),
                     [&](std::string_view below) { return name.starts_with(below); });
}

/// The device of a serial port by the name that a kernel or another system gives it; COM1 is the
/// first port of the board, which Linux counts from 0. Empty: it is no such name.
std::string bare_port(std::string_view text) {
  if (text.starts_with("/dev/")) {
    return is_file_device(text) ? std::string() : std::string(text);
  }
  for (const std::string_view kind : {"ttyUSB", "ttyACM", "ttyS", "ttyAMA"}) {
    if (text.starts_with(kind) && is_number(text.substr(kind.size()))) {
      return fmt::format("/dev/{}", text);
    }
  }
  if (!text.starts_with("COM")) return {};
  const auto number = parse_unsigned(text.substr(3), 256);
  return number && *number > 0 ? fmt::format("/dev/ttyS{}", *number - 1) : std::string();
}

/// The URL that is meant by an address or a serial port without a scheme; empty where it is none.
std::string url_of_bare(std::string_view text) {
  const auto question = std::min(text.find('?'), text.size());
  const std::string_view place = text.substr(0, question);
  const std::string_view query = text.substr(question);
  if (is_bare_host(place)) return fmt::format("tcp://{}", text);
  const std::string port = bare_port(place);
  return port.empty() ? port : fmt::format("rtu://{}{}", port, query);
}

}  // namespace

bool looks_like_url(std::string_view text) {
  return has_scheme(text) || !url_of_bare(text).empty();
}

Result<Endpoint> parse_endpoint(std::string_view url) {
  const std::string bare = url_of_bare(url);
  TRY_LET(const auto parts, take_apart(bare.empty() ? url : std::string_view(bare)));
  Endpoint endpoint;
  endpoint.text = url;
  endpoint.medium = parts.scheme->medium;
  TRY(parse_body(endpoint, parts));
  std::set<std::string_view> seen;
  if (parts.query.empty()) return endpoint;
  for (const std::string_view item : split(parts.query, '&')) {
    TRY(apply_option(endpoint, item, seen));
  }
  return check_unit(endpoint).map([&] { return endpoint; });
}

modbus::SerialSettings serial_settings(const Endpoint& endpoint,
                                       const modbus::SerialSettings& usual) {
  return {.baud = endpoint.baud.value_or(usual.baud),
          .parity = endpoint.parity.value_or(usual.parity),
          .stop_bits = endpoint.stop_bits.value_or(usual.stop_bits)};
}

std::string to_url(const Endpoint& endpoint) {
  const bool bracketed = endpoint.host.find(':') != std::string::npos;
  const auto* const scheme = std::find_if(
      schemes.begin(), schemes.end(), [&](const Scheme& s) { return s.medium == endpoint.medium; });
  std::string url =
      fmt::format("{}://{}", scheme->name, bracketed ? "[" + endpoint.host + "]" : endpoint.host);
  if (endpoint.port) url += fmt::format(":{}", *endpoint.port);
  if (endpoint.unit) url += fmt::format("?unit={}", endpoint.unit->value);
  if (endpoint.unit && endpoint.reserved_units) url += "&reserved=true";
  return url;
}

}  // namespace spindle::link
