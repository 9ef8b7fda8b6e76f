#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/disk.hpp"
#include "spindle/base/error.hpp"

/// Who may see the page. Pure, but for the file.
namespace spindle::page {

/// Reads the token of a file. Error `bad_file`: it can be read by every user or changed by another
/// one, has fewer than 16 characters, or others than those of a token (RFC 6750: letters, digits,
/// - . _ ~ + / =).
Result<std::string> read_token(const std::string& path, const Disk& disk);

/// Compares in a time that depends on the length of `given` alone.
bool is_same_secret(std::string_view given, std::string_view secret);

/// The token of "Bearer TOKEN"; empty where it is none.
std::string_view bearer_of(std::string_view authorization);

/// The value of a cookie in a header "a=b; c=d"; empty where it is not there.
std::string_view cookie_of(std::string_view cookies, std::string_view name);

/// The value of a name in the query of "/path?a=b&c=d", with what is percent-encoded decoded; empty
/// where it is not there. A plus sign and an equals sign of a value are themselves.
std::string query_value(std::string_view target, std::string_view name);

/// Whether a Host header names this computer, with any port or none: what another site made its own
/// name point to is no name of ours. `own` is the address that is listened on.
bool is_local_host(std::string_view host, std::string_view own);

/// ADDRESS:PORT of --listen.
struct ListenPlace {
  std::string address = "127.0.0.1";  ///< a numeric one
  std::uint16_t port = 8470;
};
/// Empty: the usual place. "localhost" is 127.0.0.1. Error `usage`.
Result<ListenPlace> parse_listen(std::string_view text);
/// Whether only programs of this computer reach it.
bool is_loopback(const ListenPlace& place);
/// "http://[::1]:8470".
std::string url_of(const ListenPlace& place);

}  // namespace spindle::page
