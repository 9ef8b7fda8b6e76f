#include <fmt/format.h>

#include <utility>

#include "owning.hpp"
#include "record_duty.hpp"
#include "sharing.hpp"
#include "spindle/base/text.hpp"
#include "spindle/work/store_place.hpp"
#include "watch_plan.hpp"

namespace spindle::commands {
namespace {

/// How long what was heard may take to be stored when the program ends.
constexpr Duration farewell = std::chrono::seconds(8);

Error not_stored(std::size_t left, const std::string& path) {
  return Error{
      .code = Errc::storage,
      .message = fmt::format("{} could not be stored before the end", counted(left, "record")),
      .hint =
          "see why the store cannot be written; the last event of each tool is fetched "
          "at the next start",
      .name = path};
}

work::JournalOptions pace_of(const RecordOptions& options, ServiceNews& news) {
  work::JournalOptions pace;
  if (options.gather) pace.gather = *options.gather;
  pace.alive = [&news] { news.alive(); };
  pace.alive_every = news.period().value_or(pace.alive_every);
  return pace;
}

Result<files::Tools> load_again(const Context& context) {
  return context.supervision.load_tools ? context.supervision.load_tools() : context.tools;
}

}  // namespace

Result<Outcome> record(const RecordOptions& options, Context& context) {
  ServiceNews news = begin_service(context);
  ProfileShelf shelf(context.profiles);
  TRY_LET(auto wanted, tools_to_record(options, context.tools, shelf, context));
  for (const std::string& note : wanted.notes) context.renderer.note(note);
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  TRY_LET(auto writer, store::Writer::open(path));

  std::vector<Target> targets;
  for (const WatchedTool& tool : wanted.tools) targets.push_back(tool.target());
  std::vector<report::Column> columns;
  if (options.tee) columns = columns_for(wanted.tools, shelf, options.watch, context);
  WatchStream stream(options.watch, wanted.tools.size(), columns, context,
                     options.tee ? Records::shown : Records::counted);
  TRY_LET(const auto leases, share_tools(options, stream, context));
  const auto note = [&](const std::string& sentence) { stream.note(sentence); };
  OwnedLines lines(targets, context, note);
  TRY(let_others_ask(lines, options.watch.gateway, note));
  const device::OpenTransport open_transport = lines.opener();
  Recorder recorder(*writer, stream, news, pace_of(options, news), context);
  const auto plan = [&](const catalogue::Profile& profile) {
    return plan_watch(options.watch, profile);
  };
  Roster roster([&](WatchedTool& tool, Task& task) {
    RecordedTool& recorded = recorder.recorded(tool.target());
    recorded.begin(task);
    const OwnedLines::Stay stay(lines, tool.target().endpoint);
    watch_tool(tool, open_transport, plan, device::Reconnection::whatever, recorded, context);
  });
  MetricsFile metrics(options.metrics, path, recorder);
  if (leases) {
    recorder.share(*leases);
    leases->want(names_of(wanted.tools));
    roster.allow(std::set<std::string>());
  }
  roster.want(std::move(wanted.tools));
  RecordDuty(recorder, roster, news, metrics, [&] {
    return load_again(context).and_then(
        [&](const files::Tools& tools) { return tools_to_record(options, tools, shelf, context); });
  }).attend();
  if (leases) leases->give_back();
  const std::size_t left = recorder.journal().close(farewell);
  metrics.write();
  if (left > 0) stream.fail(not_stored(left, path));
  return stream.finish();
}

}  // namespace spindle::commands
