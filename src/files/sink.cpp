#include "spindle/files/sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "spindle/base/percent.hpp"
#include "spindle/base/text.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::files {
namespace {

constexpr std::string_view usual_base = "spindle/v1";
constexpr std::uint16_t plain_port = 1883;
constexpr std::uint16_t encrypted_port = 8883;
/// Leaves room in a topic (65,535 bytes) for tools and what is behind them.
constexpr std::size_t longest_base = 1024;

struct Scheme {
  std::string_view begin;
  SinkKind kind;
  bool is_encrypted;
};
constexpr std::array<Scheme, 4> schemes = {{{"mqtt://", SinkKind::mqtt, false},
                                            {"mqtts://", SinkKind::mqtt, true},
                                            {"postgresql://", SinkKind::postgresql, false},
                                            {"postgres://", SinkKind::postgresql, false}}};

const Scheme* scheme_of(std::string_view text) {
  const auto* found = std::find_if(schemes.begin(), schemes.end(), [&](const Scheme& scheme) {
    return text.starts_with(scheme.begin);
  });
  return found == schemes.end() ? nullptr : found;
}

tl::unexpected<Error> bad(std::string message,
                          std::string hint = "write mqtts://HOST[:PORT][/TOPIC]") {
  return tl::unexpected(
      Error{.code = Errc::bad_target, .message = std::move(message), .hint = std::move(hint)});
}

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; }

Result<std::string> read_base(std::string_view path) {
  while (path.starts_with('/')) path.remove_prefix(1);
  while (path.ends_with('/')) path.remove_suffix(1);
  if (path.empty()) return std::string(usual_base);
  auto base = percent_decoded(path);
  if (!base) return bad("a '%' in the topic is not followed by two hexadecimal digits");
  const bool is_text = is_utf8(*base) && std::none_of(base->begin(), base->end(), is_control);
  if (!is_text) return bad("the topic has control characters, or is no UTF-8");
  if (base->find_first_of("+#") != std::string::npos) {
    return bad("the topic has a '+' or '#'", "these stand for any topic, and no message has them");
  }
  if (base->starts_with('$')) {
    return bad("the topic begins with '$'", "such topics belong to the broker");
  }
  if (base->size() > longest_base) {
    return bad(fmt::format("the topic has more than {} bytes", longest_base));
  }
  return std::move(*base);
}

/// HOST, HOST:PORT, [IPV6] or [IPV6]:PORT.
Result<void> read_host(std::string_view text, SinkUrl& url) {
  std::string_view port;
  bool has_port = false;
  std::string_view host = text;
  if (text.starts_with('[')) {
    const std::size_t close = text.find(']');
    if (close == std::string_view::npos) return bad("a ']' is missing behind the address");
    host = text.substr(1, close - 1);
    port = text.substr(close + 1);
    has_port = port.starts_with(':');
    if (!port.empty() && !has_port) return bad("behind ']' only a port may stand");
  } else if (const std::size_t colon = text.find(':'); colon != std::string_view::npos) {
    host = text.substr(0, colon);
    port = text.substr(colon);
    has_port = true;
  }
  const bool is_host = !host.empty() && std::none_of(host.begin(), host.end(), [](char c) {
    return is_control(c) || c == ' ';
  });
  if (!is_host) return bad("the host is missing", "mqtts://broker.example/acme/line1");
  url.host = std::string(host);
  if (!has_port) return {};
  const auto number = parse_unsigned(port.substr(1), 65'535);
  if (!number || *number == 0) return bad("the port is none of 1 to 65535");
  url.port = static_cast<std::uint16_t>(*number);
  return {};
}

Result<SinkUrl> read_mqtt(std::string_view rest, SinkUrl url) {
  if (rest.find_first_of("?#") != std::string_view::npos) {
    return bad("a URL of MQTT has no '?' and no '#'",
               "what else is to be said stands under 'sinks' of the tools file");
  }
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  if (rest.substr(0, slash).find('@') != std::string_view::npos) {
    return bad("a user does not stand in the URL of a broker",
               "name the sink under 'sinks' of the tools file, with user and password-file");
  }
  url.port = url.is_encrypted ? encrypted_port : plain_port;
  TRY(read_host(rest.substr(0, slash), url));
  TRY_LET(url.base, read_base(rest.substr(slash)));
  return url;
}

/// Where libpq would look for one.
bool has_password(std::string_view rest) {
  const std::size_t end = std::min(rest.find_first_of("/?"), rest.size());
  const std::size_t at = rest.substr(0, end).rfind('@');
  if (at != std::string_view::npos && rest.substr(0, at).find(':') != std::string_view::npos) {
    return true;
  }
  const std::size_t question = rest.find('?');
  if (question == std::string_view::npos) return false;
  for (const std::string_view option : split(rest.substr(question + 1), '&')) {
    const auto name = percent_decoded(option.substr(0, option.find('=')));
    if (name && (*name == "password" || *name == "sslpassword")) return true;
  }
  return false;
}

}  // namespace

bool names_sink(std::string_view text) { return scheme_of(text) != nullptr; }

Result<SinkUrl> parse_sink_url(std::string_view text) {
  const Scheme* scheme = scheme_of(text);
  if (scheme == nullptr) {
    return bad("it is no URL of a sink",
               "sinks are mqtts://HOST/TOPIC, mqtt://HOST/TOPIC and postgresql://HOST/DATABASE");
  }
  SinkUrl url = {.kind = scheme->kind, .text = std::string(text)};
  url.is_encrypted = scheme->is_encrypted;
  const std::string_view rest = text.substr(scheme->begin.size());
  if (has_password(rest)) {
    return bad("a password may not stand in a URL",
               "put it into a file of its own: password-file under 'sinks' of the tools file");
  }
  if (url.kind == SinkKind::mqtt) return read_mqtt(rest, std::move(url));
  return url;
}

Result<Sink> sink_of_url(const std::string& url) {
  TRY(parse_sink_url(url));
  return Sink{.name = url, .urls = {url}};
}

}  // namespace spindle::files
