#include "spindle/report/renderer.hpp"

#include "display.hpp"
#include "renderers.hpp"

namespace spindle::report {

std::unique_ptr<Renderer> make_renderer(Format format, Streams& streams, Verbosity verbosity) {
  switch (format) {
    case Format::json:
      return make_json_renderer(streams, verbosity);
    case Format::csv:
      return make_csv_renderer(streams, verbosity);
    case Format::table:
      break;
  }
  return make_table_renderer(streams, verbosity);
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
  std::string line;
  if (streams.err_is_journal)
    line = {'<', static_cast<char>('0' + static_cast<int>(severity)), '>'};
  streams.err(line + printable(text, LineBreaks::fold) + "\n");
}

void say_error(const Streams& streams, const Error& error) {
  say_line(streams, Severity::error, "spindle: " + describe(error));
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
