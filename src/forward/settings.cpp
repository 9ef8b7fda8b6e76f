#include "settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "spindle/base/local_time.hpp"
#include "spindle/base/text.hpp"

namespace spindle::forward {
namespace {

Result<files::Sink> named_or_url(const std::string& text, const files::Tools& tools) {
  std::vector<std::string> names;
  for (const files::Sink& sink : tools.sinks) {
    if (sink.name == text) return files::usable_sink(sink, tools);
    names.push_back(sink.name);
  }
  if (text.find("://") != std::string::npos) {
    auto sink = files::sink_of_url(text);
    if (!sink) sink.error().name = "SINK";
    return sink;
  }
  std::string hint = suggestion(text, names);
  if (hint.empty()) {
    hint =
        "give a URL, such as mqtts://broker.example/acme/line1, or name it under 'sinks' of the "
        "tools file";
  }
  return tl::unexpected(Error{.code = Errc::unknown_name,
                              .message = fmt::format("there is no sink '{}'", text),
                              .hint = std::move(hint),
                              .name = tools.path});
}

Result<store::Positions> positions_at(store::RowId id, store::Reader& reader) {
  std::optional<WallTime> at;
  TRY(reader.events({.after = id - 1}, [&](const store::EventView& row) {
    at = row.at;
    return false;
  }));
  if (!at) return reader.ends();
  TRY_LET(auto positions, reader.before(*at));
  positions.event = id - 1;
  return positions;
}

}  // namespace

Result<files::Sink> find_sink(const commands::ForwardOptions& options, const files::Tools& tools) {
  TRY_LET(auto sink, named_or_url(options.sink, tools));
  if (!options.window) return sink;
  TRY_LET(const auto url, files::parse_sink_url(sink.urls.front()));
  if (url.kind != files::SinkKind::mqtt) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "is about MQTT",
                                .hint = "'batch' of the sink says how many rows go together",
                                .name = "--window"});
  }
  sink.window = options.window;
  return sink;
}

Result<std::optional<std::string>> read_secrets(const files::Sink& sink,
                                                const std::optional<std::string>& credentials,
                                                const Disk& disk) {
  for (const std::string& certificates : {sink.ca_file, sink.cert_file}) {
    if (certificates.empty()) continue;
    TRY(disk.read(certificates));
  }
  if (!sink.key_file.empty()) {
    TRY(disk.read_secret(sink.key_file));
  }
  std::string file = sink.password_file;
  if (file.empty() && credentials) {
    std::string given = *credentials + "/" + sink.name;
    if (disk.exists(given)) file = std::move(given);
  }
  if (file.empty()) return std::nullopt;
  TRY_LET(const auto text, disk.read_secret(file));
  std::string password = text.substr(0, text.find_first_of("\r\n"));
  if (!password.empty()) return password;
  return tl::unexpected(Error{.code = Errc::bad_file,
                              .message = "its first line, the password, is empty",
                              .name = std::move(file)});
}

Result<store::Positions> positions_from(const std::string& text, store::Reader& reader,
                                        const Clock& clock) {
  constexpr auto longest = static_cast<std::uint64_t>(std::numeric_limits<store::RowId>::max());
  const bool is_number = !text.empty() && std::all_of(text.begin(), text.end(),
                                                      [](char c) { return c >= '0' && c <= '9'; });
  const auto id = is_number ? parse_unsigned(text, longest) : std::nullopt;
  if (id && *id > 0) return positions_at(static_cast<store::RowId>(*id), reader);
  auto time = parse_time(text, clock);
  if (!time) {
    time.error().name = "--from";
    return tl::unexpected(std::move(time.error()));
  }
  return reader.before(*time);
}

}  // namespace spindle::forward
