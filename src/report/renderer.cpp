#include "spindle/report/renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "display.hpp"
#include "renderers.hpp"
#include "spindle/base/text.hpp"

namespace spindle::report {
namespace {

const std::string indent = "  ";

/// As people read it: the cause, what can be pasted, and what else would help.
std::string sentences_of(const Error& error, const std::string& command, std::size_t columns) {
  const std::string hint = hint_of(error);
  std::string cause = printable("spindle: " + cause_of(error), LineBreaks::fold);
  std::string whole =
      hint.empty() ? cause : printable("spindle: " + describe(error), LineBreaks::fold);
  const bool is_short = display_width(whole) <= columns;
  std::string text = wrapped(is_short ? whole : cause, columns);
  if (!command.empty())
    text += fmt::format("\n{}try: {}", indent, printable(command, LineBreaks::fold));
  const bool is_said =
      !command.empty() && hint == fmt::format("did you mean '{}'?", error.remedy.right);
  if (!is_short && !hint.empty() && !is_said)
    text += "\n" + wrapped(indent + printable(hint, LineBreaks::fold), columns);
  for (const std::string& detail : error.details) {
    text += "\n" + wrapped(indent + printable(detail, LineBreaks::fold), columns);
  }
  return text;
}

}  // namespace

std::size_t columns_of(const Streams& streams) {
  constexpr std::size_t widest = 100;
  constexpr std::size_t narrowest = 40;
  const std::size_t shown =
      streams.err_is_terminal && streams.err_columns ? streams.err_columns() : 0;
  return shown >= narrowest && shown < widest ? shown : widest;
}

std::string wrapped(std::string_view text, std::size_t columns) {
  std::string lines;
  std::size_t width = 0;
  const auto begin = std::min(text.find_first_not_of(' '), text.size());
  std::string word(text.substr(0, begin));
  for (const std::string_view next : split(text.substr(begin), ' ')) {
    word += next;
    const std::size_t wide = display_width(word);
    // "spindle:" alone says nothing.
    const bool is_mark = lines.ends_with(':') && lines.find(' ') == std::string::npos;
    const bool fits = width == 0 || is_mark || width + 1 + wide <= columns;
    if (width > 0) lines += fits ? " " : "\n" + indent;
    width = width == 0 ? wide : fits ? width + 1 + wide : indent.size() + wide;
    lines += std::exchange(word, {});
  }
  return lines;
}

std::unique_ptr<Renderer> make_renderer(const Look& look, Streams& streams) {
  switch (look.format) {
    case Format::json:
      return make_json_renderer(streams, look.verbosity);
    case Format::yaml:
      return make_yaml_renderer(streams, look.verbosity);
    case Format::csv:
      return make_csv_renderer(streams, look);
    case Format::value:
      return make_value_renderer(streams, look);
    case Format::table:
    case Format::wide:
    case Format::svg:
      break;
  }
  return make_table_renderer(streams, look);
}

std::unique_ptr<Renderer> make_renderer(Format format, Streams& streams, Verbosity verbosity) {
  return make_renderer({.format = format, .verbosity = verbosity}, streams);
}

Record error_record(const Error& error, WallTime time) {
  const StatusInfo& status = info(error.status());
  Record record{
      .type = "error",
      .target = error.target.empty() ? error.asked_of : error.target,
      .time = time,
      .fields = {{"code", std::string(status.name)},
                 {"exit_status", number(static_cast<std::int64_t>(status.status))},
                 {"message", message_of(error)},
                 {"hint", text_or_null(hint_of(error))}},
  };
  if (!error.name.empty()) record.fields.push_back({"name", error.name});
  if (error.register_address) {
    record.fields.push_back({"register", number(*error.register_address)});
  }
  if (error.exception) record.fields.push_back({"exception", number(*error.exception)});
  if (error.device_code) record.fields.push_back({"device_code", number(*error.device_code)});
  if (!error.endpoint.empty()) record.fields.push_back({"endpoint", error.endpoint});
  return record;
}

Result<void> LineWriter::write(std::string_view line) {
  const bool cut_off =
      !has_begun_ && streams_->out_ends_within_line && streams_->out_ends_within_line();
  auto written = cut_off ? streams_->out(std::string(line_end_).append(line)) : streams_->out(line);
  has_begun_ = has_begun_ || written.has_value();
  return written;
}

void say_line(const Streams& streams, Severity severity, std::string_view text) {
  const std::string line = printable(text, LineBreaks::fold);
  if (!streams.err_is_journal) return streams.err(wrapped(line, columns_of(streams)) + "\n");
  streams.err(fmt::format("<{}>{}\n", static_cast<int>(severity), line));
}

void say_frame(const Streams& streams, std::string_view text) {
  if (streams.err_is_journal) return say_line(streams, Severity::informational, text);
  streams.err(printable(text, LineBreaks::fold) + "\n");
}

void say_error(const Streams& streams, const Error& error) {
  if (streams.err_is_journal) {
    return say_line(streams, Severity::error, "spindle: " + describe(error));
  }
  streams.err(sentences_of(error, command_to_try(error, streams.typed), columns_of(streams)) +
              "\n");
}

void say_warning(const Streams& streams, std::string_view sentence) {
  if (streams.err_is_ready && !streams.err_is_ready()) return;
  say_line(streams, Severity::warning, sentence);
}

void say_sentence(const Streams& streams, Verbosity verbosity, Severity severity,
                  std::string_view sentence) {
  if (verbosity == Verbosity::quiet || sentence.empty()) return;
  say_line(streams, severity, sentence);
}

Result<void> PlainRenderer::line(const Record& /*record*/, std::string_view plain) {
  return streams_.out(printable(plain, LineBreaks::fold) + "\n");
}

void PlainRenderer::note(std::string_view sentence) {
  say_sentence(streams_, verbosity_, Severity::notice, sentence);
}

Result<void> PlainRenderer::summary(const Record& /*record*/, std::string_view sentence) {
  say_sentence(streams_, verbosity_, Severity::informational, sentence);
  return {};
}

Result<void> PlainRenderer::error(const Error& error, WallTime /*time*/) {
  say_error(streams_, error);
  return {};
}

}  // namespace spindle::report
