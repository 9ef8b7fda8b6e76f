#include "page/access.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "spindle/base/text.hpp"

namespace spindle::page {
namespace {

constexpr std::size_t shortest_token = 16;
constexpr std::size_t longest_token = 512;

bool is_token_character(char c) {
  const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
  return is_letter || (c >= '0' && c <= '9') ||
         std::string_view("-._~+/=").find(c) != std::string_view::npos;
}

Error bad_token(const std::string& path, std::string message, std::string hint) {
  return {
      .code = Errc::bad_file, .message = std::move(message), .hint = std::move(hint), .name = path};
}

std::string_view without_blanks(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\n";
  const std::size_t begin = std::min(text.find_first_not_of(blanks), text.size());
  return text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

std::string decoded(std::string_view text) {
  constexpr std::size_t length = 3;
  std::string plain;
  while (!text.empty()) {
    const auto code = text.front() == '%' && text.size() >= length
                          ? parse_unsigned("0x" + std::string(text.substr(1, 2)), 0xFF)
                          : std::nullopt;
    plain += code ? static_cast<char>(*code) : text.front();
    text.remove_prefix(code ? length : 1);
  }
  return plain;
}

/// "localhost" of "localhost:8470", "::1" of "[::1]:8470".
std::string_view name_of_host(std::string_view host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? std::string_view() : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

Error bad_place(std::string_view text) {
  return {.code = Errc::usage,
          .message = fmt::format("'{}' is no place to listen on", text),
          .hint = "it takes a numeric address and a port, such as 127.0.0.1:8470 or [::1]:8470",
          .name = "--listen"};
}

bool is_version_6(const std::string& address) {
  in6_addr parsed = {};
  return ::inet_pton(AF_INET6, address.c_str(), &parsed) == 1;
}

std::optional<std::uint32_t> version_4(const std::string& address) {
  in_addr parsed = {};
  if (::inet_pton(AF_INET, address.c_str(), &parsed) != 1) return std::nullopt;
  return ntohl(parsed.s_addr);
}

}  // namespace

Result<std::string> read_token(const std::string& path, const Disk& disk) {
  struct stat facts = {};
  if (::stat(path.c_str(), &facts) == 0 && (facts.st_mode & (S_IRWXO | S_IWGRP)) != 0) {
    return tl::unexpected(bad_token(path, "its token is no secret: other users may open the file",
                                    fmt::format("chmod 600 {}", shell_word(path))));
  }
  TRY_LET(const std::string text, disk.read(path));
  const std::string_view token = without_blanks(text);
  const bool fits = token.size() >= shortest_token && token.size() <= longest_token &&
                    std::all_of(token.begin(), token.end(), is_token_character);
  if (fits) return std::string(token);
  return tl::unexpected(
      bad_token(path,
                fmt::format("it holds no token: one line of {} to {} letters, digits and -._~+/=",
                            shortest_token, longest_token),
                "openssl rand -base64 24 makes a good one"));
}

bool is_same_secret(std::string_view given, std::string_view secret) {
  if (secret.empty()) return false;
  unsigned difference = given.size() == secret.size() ? 0 : 1;
  for (std::size_t at = 0; at < given.size(); ++at) {
    difference |= static_cast<unsigned>(static_cast<unsigned char>(given[at]) ^
                                        static_cast<unsigned char>(secret[at % secret.size()]));
  }
  return difference == 0;
}

std::string_view bearer_of(std::string_view authorization) {
  constexpr std::string_view scheme = "bearer ";
  if (!same_ignoring_case(authorization.substr(0, scheme.size()), scheme)) return {};
  return without_blanks(authorization.substr(scheme.size()));
}

std::string_view cookie_of(std::string_view cookies, std::string_view name) {
  for (const std::string_view part : split(cookies, ';')) {
    const std::string_view cookie = without_blanks(part);
    const std::size_t sign = cookie.find('=');
    if (sign != std::string_view::npos && cookie.substr(0, sign) == name) {
      return cookie.substr(sign + 1);
    }
  }
  return {};
}

std::string query_value(std::string_view target, std::string_view name) {
  const std::size_t mark = target.find('?');
  if (mark == std::string_view::npos) return {};
  for (const std::string_view part : split(target.substr(mark + 1), '&')) {
    const std::size_t sign = part.find('=');
    if (sign == std::string_view::npos || part.substr(0, sign) != name) continue;
    return decoded(part.substr(sign + 1));
  }
  return {};
}

bool is_local_host(std::string_view host, std::string_view own) {
  const std::string_view name = name_of_host(host);
  constexpr std::array<std::string_view, 3> names = {"127.0.0.1", "::1", "localhost"};
  return !name.empty() &&
         (name == own || std::any_of(names.begin(), names.end(), [&](std::string_view local) {
            return same_ignoring_case(name, local);
          }));
}

Result<ListenPlace> parse_listen(std::string_view text) {
  ListenPlace place;
  if (text.empty()) return place;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return tl::unexpected(bad_place(text));
  std::string_view host = text.substr(0, colon);
  const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (in_brackets) host = host.substr(1, host.size() - 2);
  const auto port = parse_unsigned(text.substr(colon + 1), 0xFFFF);
  place.address = same_ignoring_case(host, "localhost") ? "127.0.0.1" : std::string(host);
  const bool is_address =
      in_brackets ? is_version_6(place.address) : version_4(place.address).has_value();
  if (!is_address || !port) return tl::unexpected(bad_place(text));
  place.port = static_cast<std::uint16_t>(*port);
  return place;
}

bool is_loopback(const ListenPlace& place) {
  constexpr std::uint32_t loopback = 127;
  const auto address = version_4(place.address);
  if (address) return *address >> 24 == loopback;
  in6_addr parsed = {};
  return ::inet_pton(AF_INET6, place.address.c_str(), &parsed) == 1 &&
         IN6_IS_ADDR_LOOPBACK(&parsed);
}

std::string url_of(const ListenPlace& place) {
  return is_version_6(place.address) ? fmt::format("http://[{}]:{}", place.address, place.port)
                                     : fmt::format("http://{}:{}", place.address, place.port);
}

}  // namespace spindle::page
