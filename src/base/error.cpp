#include "spindle/base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle {
namespace {

constexpr std::array statuses = {
    StatusInfo{ExitStatus::ok, "ok", "everything asked for was done"},
    StatusInfo{ExitStatus::negative, "negative",
               "done, and the answer is no: diff found differences, a remote start ended NG, a "
               "condition was not met in time"},
    StatusInfo{ExitStatus::usage, "usage",
               "the request is wrong: option, name, value outside the range, read-only, not "
               "confirmed, unverified action not accepted"},
    StatusInfo{ExitStatus::bad_file, "bad_file", "a profile, backup or tools file cannot be used"},
    StatusInfo{ExitStatus::unreachable, "unreachable",
               "no connection (name not found, refused, no route, connect timeout, port missing or "
               "busy)"},
    StatusInfo{ExitStatus::no_answer, "no_answer",
               "connected, but no answer in time, or the link broke"},
    StatusInfo{ExitStatus::refused, "refused", "the tool answered with a Modbus exception"},
    StatusInfo{ExitStatus::malformed, "malformed", "an answer that breaks the protocol"},
    StatusInfo{ExitStatus::mismatch, "mismatch",
               "a read-back, a restore check or the tool's identity differs from what was "
               "expected"},
    StatusInfo{ExitStatus::partial, "partial", "several targets or parameters, and some failed"},
    StatusInfo{ExitStatus::internal, "internal", "a bug in spindle"},
    StatusInfo{ExitStatus::storage, "storage",
               "a file, the store, the disk or standard output cannot be written"},
    StatusInfo{ExitStatus::interrupted, "interrupted", "SIGINT, after the tool was left safe"},
    StatusInfo{ExitStatus::terminated, "interrupted", "SIGTERM, after the tool was left safe"},
};

constexpr std::array errors = {
    ErrcInfo{Errc::negative, ExitStatus::negative, "done, and the answer is no", ""},
    ErrcInfo{Errc::usage, ExitStatus::usage, "the request is wrong", ""},
    ErrcInfo{Errc::unknown_name, ExitStatus::usage, "unknown name",
             "'spindle list' shows the names that the profile knows"},
    ErrcInfo{Errc::bad_value, ExitStatus::usage, "the value does not fit its type", ""},
    ErrcInfo{Errc::out_of_range, ExitStatus::usage, "the value is outside the range", ""},
    ErrcInfo{Errc::read_only, ExitStatus::usage, "read-only, it cannot be written",
             "'spindle list' shows what can be written", "spindle list TARGET"},
    ErrcInfo{Errc::not_confirmed, ExitStatus::usage, "not confirmed, nothing was changed",
             "answer 'y', or add --yes, when you are sure"},
    ErrcInfo{Errc::unverified, ExitStatus::usage,
             "this action is not verified on this product, nothing was sent",
             "check it on the tool, then give --accept-unverified or list it under 'verified' in "
             "the tools file"},
    ErrcInfo{Errc::bad_file, ExitStatus::bad_file, "the file cannot be used", ""},
    ErrcInfo{Errc::bad_target, ExitStatus::usage, "this is not a target",
             "give a name from the tools file, tcp://HOST[:PORT], rtu:///dev/ttyUSB0?unit=1 or "
             "sim:PROFILE"},
    ErrcInfo{Errc::name_not_found, ExitStatus::unreachable, "the host name was not found",
             "check the spelling, or use the tool's IP address"},
    ErrcInfo{Errc::connection_refused, ExitStatus::unreachable, "connection refused",
             "is this the tool's address and port? another client may hold its only session"},
    ErrcInfo{Errc::no_route, ExitStatus::unreachable, "no route to the tool",
             "is this computer in the tool's network? check cable, Wi-Fi and address"},
    ErrcInfo{Errc::connect_timeout, ExitStatus::unreachable, "no connection within {waited}",
             "the tool may be asleep, switched off or out of Wi-Fi range"},
    ErrcInfo{Errc::port_missing, ExitStatus::unreachable, "there is no such serial port",
             "is the adapter plugged in? 'ls /dev/serial/by-id' shows the ones that are",
             "ls /dev/serial/by-id"},
    ErrcInfo{Errc::port_busy, ExitStatus::unreachable,
             "the serial port is in use by another program",
             "close the other program; 'fuser -v' and the port's path show which it is"},
    ErrcInfo{Errc::port_unusable, ExitStatus::unreachable,
             "the serial port cannot be used with these settings",
             "check your permission (group dialout), and that the adapter supports baud rate and "
             "parity"},
    ErrcInfo{Errc::no_answer, ExitStatus::no_answer,
             "connected, but no answer to '{tried}' within {waited}",
             "the tool may be asleep, or another client holds its session"},
    ErrcInfo{Errc::incomplete_answer, ExitStatus::no_answer,
             "the answer to '{tried}' began but was not complete within {waited}",
             "the link is weak or slow: try again, or a longer --timeout"},
    ErrcInfo{Errc::closed, ExitStatus::no_answer, "the tool closed the connection during '{tried}'",
             "another client may have taken its session, or the tool went to sleep; try again"},
    ErrcInfo{Errc::reset, ExitStatus::no_answer, "the connection was reset during '{tried}'",
             "the tool may have restarted or lost the Wi-Fi; try again"},
    ErrcInfo{Errc::exception_response, ExitStatus::refused,
             "the tool refused '{tried}' with {exception}", ""},
    ErrcInfo{Errc::malformed_answer, ExitStatus::malformed,
             "the answer to '{tried}' breaks the protocol",
             "is this a Modbus tool of this kind? --verbose shows the bytes"},
    ErrcInfo{Errc::bad_checksum, ExitStatus::malformed,
             "the answer to '{tried}' has a wrong checksum",
             "check wiring, termination, baud rate and parity; is another client on the line?"},
    ErrcInfo{Errc::local_echo, ExitStatus::malformed,
             "only the echo of '{tried}' came back, no tool answered",
             "the adapter echoes what it sends: check the wiring and the unit address"},
    ErrcInfo{Errc::mismatch, ExitStatus::mismatch, "differs from what was expected", ""},
    ErrcInfo{Errc::wrong_generation, ExitStatus::mismatch,
             "the tool is of another generation than this profile",
             "only raw registers such as @holding:2 can be read"},
    ErrcInfo{Errc::wrong_model, ExitStatus::mismatch, "the tool is another model than expected",
             "check the target, or give the profile that fits"},
    ErrcInfo{Errc::partial, ExitStatus::partial, "some of it failed", ""},
    ErrcInfo{Errc::internal, ExitStatus::internal, "internal error",
             "this is a bug in spindle: please report it with the output of --verbose"},
    ErrcInfo{Errc::storage, ExitStatus::storage, "cannot be written",
             "check the file, disk or program that it goes to"},
    ErrcInfo{Errc::interrupted, ExitStatus::interrupted, "interrupted", ""},
    ErrcInfo{Errc::terminated, ExitStatus::terminated, "terminated", ""},
    ErrcInfo{Errc::closed_pipe, ExitStatus::ok, "the output has no reader any more", ""},
};

// info() finds a row by its place.
constexpr bool rows_are_in_order() {
  for (std::size_t row = 0; row < errors.size(); ++row) {
    if (errors[row].code != static_cast<Errc>(row)) return false;
  }
  return errors.back().code == Errc::closed_pipe;
}
static_assert(rows_are_in_order());

void replace(std::string& text, std::string_view what, std::string_view by) {
  const std::size_t at = text.find(what);
  if (at != std::string::npos) text.replace(at, what.size(), by);
}

// A measured time has digits that are not worth reading.
std::string waited_text(Duration waited) {
  using std::chrono::milliseconds;
  if (waited < milliseconds(1)) return to_text(waited);
  return to_text(std::chrono::duration_cast<milliseconds>(waited));
}

std::string expand(std::string_view sentence, const Error& error) {
  std::string text(sentence);
  // A line also breaks while nothing is asked.
  if (error.tried.empty()) replace(text, " during '{tried}'", "");
  replace(text, "'{tried}'", error.tried.empty() ? "the request" : "'" + error.tried + "'");
  replace(text, "{waited}", error.waited ? waited_text(*error.waited) : "the time allowed");
  replace(text, "{exception}",
          error.exception ? fmt::format("exception 0x{:02X}", *error.exception) : "an exception");
  return text;
}

std::string place_of(const Error& error) {
  if (error.endpoint.empty()) return error.target;
  const bool is_url = error.target.find("://") != std::string::npos;
  return is_url ? error.endpoint : fmt::format("{} ({})", error.target, error.endpoint);
}

// Names and messages may quote foreign text; it must break neither the line nor the terminal.
std::string on_one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, ' ');
  return text;
}

// Whether `wrong` stands there alone, on one side of the first '=' or behind a ":"; then it is
// replaced.
bool replace_word(std::string& word, const Remedy& remedy) {
  const auto& [wrong, right] = remedy;
  const std::size_t equals = word.find('=');
  if (word == wrong) {
    word = right;
  } else if (equals != std::string::npos && std::string_view(word).substr(0, equals) == wrong) {
    word.replace(0, equals, right);
  } else if (equals != std::string::npos && std::string_view(word).substr(equals + 1) == wrong) {
    word.replace(equals + 1, std::string::npos, right);
  } else if (word.ends_with(":" + wrong)) {  // sim:PROFILE
    word.replace(word.size() - wrong.size(), wrong.size(), right);
  } else {
    return false;
  }
  return true;
}

}  // namespace

Remedy remedy_for(std::string_view word, const std::vector<std::string>& known,
                  std::string command) {
  if (auto meant = closest(word, known)) return {std::string(word), std::move(*meant)};
  return {.right = std::move(command)};
}

std::span<const StatusInfo> status_table() { return statuses; }

std::span<const ErrcInfo> errc_table() { return errors; }

const StatusInfo& info(ExitStatus status) {
  const auto* row = std::ranges::find(statuses, status, &StatusInfo::status);
  return row != statuses.end() ? *row : info(ExitStatus::internal);
}

const ErrcInfo& info(Errc code) { return errors[static_cast<std::size_t>(code)]; }

std::string message_of(const Error& error) {
  return error.message.empty() ? expand(info(error.code).text, error) : error.message;
}

std::string hint_of(const Error& error) {
  return error.hint.empty() ? std::string(info(error.code).hint) : error.hint;
}

std::string cause_of(const Error& error) {
  std::string text;
  const std::string place = place_of(error);
  for (const std::string* part : {&place, &error.name}) {
    if (!part->empty()) text += *part + ": ";
  }
  return on_one_line(text + message_of(error));
}

std::string command_to_try(const Error& error, const std::vector<std::string>& typed) {
  const Remedy& remedy = error.remedy;
  constexpr std::string_view target = "TARGET";
  const bool is_usual = remedy.right.empty() && error.hint.empty();
  std::string command = is_usual ? std::string(info(error.code).command) : remedy.right;
  if (command.empty()) return {};
  if (remedy.wrong.empty()) {
    if (command.find(target) == std::string::npos) return command;
    const std::string& tool = error.target.empty() ? error.asked_of : error.target;
    if (tool.empty()) return {};
    replace(command, target, shell_word(tool));
    return command;
  }
  command = "spindle";
  bool is_replaced = false;
  for (std::string word : typed) {
    is_replaced = is_replaced || replace_word(word, remedy);
    command += " " + shell_word(word);
  }
  return is_replaced ? command : std::string();
}

std::string describe(const Error& error) {
  std::string text = cause_of(error);
  const std::string hint = hint_of(error);
  return hint.empty() ? text : on_one_line(text + "; " + hint);
}

}  // namespace spindle
