#include "postgres_errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "spindle/base/text.hpp"

namespace spindle::forward {
namespace {

constexpr std::size_t state_size = 5;

bool is_state(std::string_view text) {
  return text.size() == state_size && std::ranges::all_of(text, [](unsigned char c) {
           return std::isdigit(c) != 0 || (std::isupper(c) != 0);
         });
}

/// The text without its SQLSTATE, and that: "FATAL:  28P01: password …".
struct Said {
  std::string state = {};
  std::string text = {};
};

Said said_in_line(std::string_view line) {
  for (std::size_t at = line.find(":  "); at != std::string_view::npos;
       at = line.find(":  ", at + 1)) {
    const std::string_view rest = line.substr(at + 3);
    if (rest.size() < state_size + 2 || !is_state(rest.substr(0, state_size))) continue;
    if (rest.substr(state_size, 2) != ": ") continue;
    return {.state = std::string(rest.substr(0, state_size)),
            .text = fmt::format("{}: {}", line.substr(0, at), rest.substr(state_size + 2))};
  }
  return {.text = std::string(line)};
}

/// One line of all that is not for the server's own developers. What libpq itself asks or supposes
/// stands on lines with a tab, and our own hint says it.
Said said_in(const std::string& text) {
  Said all;
  for (const std::string_view line : split(text, '\n')) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string_view::npos || line.starts_with("LOCATION:")) continue;
    if (line.starts_with('\t') && !all.text.empty()) continue;
    Said one = said_in_line(line.substr(begin));
    if (!one.state.empty()) all.state = one.state;
    all.text += (all.text.empty() ? "" : "; ") + one.text;
  }
  return all;
}

/// What a phrase of libpq or of the C library means.
struct Phrase {
  std::string_view text;
  Errc code;
  std::string_view hint;
};

constexpr std::string_view certificate_hint =
    "give the certificate of who signed the server's as 'ca-file' of the sink or "
    "sslrootcert=FILE in the URL, and the host name that stands in the server's own";
constexpr std::string_view password_hint =
    "give the sink a 'password-file', or use ~/.pgpass (PGPASSFILE); pg_hba.conf of the server "
    "says who may connect";

// The first one counts: a message may have several.
constexpr std::array phrases = {
    Phrase{"could not translate host name", Errc::name_not_found, ""},
    Phrase{"root certificate file", Errc::bad_file, certificate_hint},
    Phrase{"could not read root certificate", Errc::bad_file, certificate_hint},
    Phrase{"could not load private key file", Errc::bad_file, "check the files of the sink"},
    Phrase{"could not read certificate file", Errc::bad_file, "check the files of the sink"},
    Phrase{"private key file", Errc::bad_file, "check the files of the sink"},
    Phrase{"certificate", Errc::mismatch, certificate_hint},
    Phrase{"server does not support SSL", Errc::mismatch,
           "switch TLS on at the server, or write sslmode=disable into the URL where the network "
           "itself is trusted"},
    Phrase{"SSL error", Errc::mismatch, certificate_hint},
    Phrase{"no password supplied", Errc::exception_response, password_hint},
    Phrase{"Connection refused", Errc::connection_refused,
           "is the server running, and does it listen at this address and port?"},
    Phrase{"No such file or directory", Errc::connection_refused,
           "is the server running, and does it listen at this address and port?"},
    Phrase{"No route to host", Errc::no_route, "check cable and address"},
    Phrase{"Network is unreachable", Errc::no_route, "check cable and address"},
    Phrase{"timed out", Errc::connect_timeout, "the server may be down, or a firewall between"},
    Phrase{"timeout expired", Errc::connect_timeout,
           "the server may be down, or a firewall between"},
    Phrase{"server closed the connection", Errc::closed, "try again; the server's log says why"},
};

bool is_any_of(std::string_view state, std::initializer_list<std::string_view> heads) {
  return std::ranges::any_of(heads, [&](std::string_view head) { return state.starts_with(head); });
}

}  // namespace

Error statement_error(const std::string& state, const std::string& message) {
  Error error{.code = Errc::exception_response,
              .message = fmt::format("the database says: {} ({})", message, state)};
  if (state.starts_with("28")) {
    error.hint = password_hint;
  } else if (state == "42501") {
    error.hint = "GRANT spindle_writer to this role; --print-schema makes it";
  } else if (state.starts_with("42")) {
    error.code = Errc::mismatch;
    error.hint = "'spindle forward SINK --print-schema' prints the tables as they have to be";
  } else if (is_any_of(state, {"08", "53", "57P", "25006"})) {
    // It stops, starts, recovers or is full: another moment, or another server.
    error.code = Errc::connection_refused;
    error.hint = "the server is there but takes nothing now";
  } else if (is_any_of(state, {"40", "57014", "55P03"})) {
    error.code = Errc::no_answer;
    error.hint = "it is tried again";
  } else if (is_any_of(state, {"22", "23"})) {
    error.code = Errc::bad_value;
  } else {
    error.hint = "the server's log may say more";
  }
  return error;
}

Error connection_error(const std::string& text) {
  const Said said = said_in(text);
  Error error{.code = Errc::closed,
              .message = said.text.empty() ? "no connection to the database" : said.text,
              .hint = "the server's log may say why"};
  if (!said.state.empty()) {
    const Error judged = statement_error(said.state, said.text);
    error.code = judged.code;
    error.hint = judged.hint;
    return error;
  }
  for (const Phrase& phrase : phrases) {
    if (said.text.find(phrase.text) == std::string::npos) continue;
    error.code = phrase.code;
    error.hint = phrase.hint;
    return error;
  }
  return error;
}

}  // namespace spindle::forward
