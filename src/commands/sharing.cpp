#include "sharing.hpp"

#include <algorithm>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/files/sink.hpp"

namespace spindle::commands {
namespace {

Error no_database(const RecordOptions& options, std::string message, std::string hint) {
  return {.code = Errc::usage,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = "--lease " + options.lease};
}

/// Whether it is one of PostgreSQL is known before any tool is asked.
Result<void> check_sink(const RecordOptions& options, const Context& context) {
  std::vector<std::string> names;
  std::optional<files::Sink> sink;
  for (const files::Sink& known : context.tools.sinks) {
    names.push_back(known.name);
    if (known.name != options.lease) continue;
    TRY_LET(sink, files::usable_sink(known, context.tools));
  }
  const bool is_url = options.lease.find("://") != std::string::npos;
  if (!sink && is_url) {
    // A password in it must not be shown.
    auto named = files::sink_of_url(options.lease);
    if (!named) named.error().name = "--lease";
    TRY(named);
    sink = std::move(*named);
  }
  if (!sink) {
    const std::string hint = suggestion(options.lease, names);
    return tl::unexpected(no_database(
        options, "there is no such sink",
        hint.empty() ? "give postgresql://HOST/DATABASE, or name it under 'sinks' of the tools file"
                     : hint));
  }
  TRY_LET(const auto url, files::parse_sink_url(sink->urls.front()));
  if (url.kind == files::SinkKind::postgresql) return {};
  return tl::unexpected(no_database(options, "leases need a PostgreSQL database",
                                    "a broker cannot say who holds a tool"));
}

}  // namespace

Result<std::unique_ptr<Leases>> share_tools(const RecordOptions& options, WatchStream& stream,
                                            Context& context) {
  if (options.lease.empty()) return std::unique_ptr<Leases>();
  TRY(check_sink(options, context));
  std::vector<std::string> arguments = {"forward", options.lease, "--leases"};
  if (!context.tools.path.empty()) {
    arguments.insert(arguments.end(), {"--tools", context.tools.path});
  }
  const auto& start = context.companions.start_forward;
  if (!start) {
    return tl::unexpected(no_database(options, "no other program can be started here", ""));
  }
  return std::make_unique<Leases>(
      [start, arguments, &context] { return start(arguments, context.clock, context.interrupt); },
      options.lease_ttl, context.clock, context.interrupt,
      [&stream](const std::string& text) { stream.note(text); });
}

}  // namespace spindle::commands
