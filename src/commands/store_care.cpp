#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "consent.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "result_selection.hpp"
#include "spindle/base/local_time.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/store/writer.hpp"
#include "spindle/work/store_place.hpp"

namespace spindle::commands {
namespace {

/// How many events there are that are older.
Result<std::size_t> count_older(store::Reader& reader, WallTime before) {
  std::size_t events = 0;
  return reader
      .events({.until = before},
              [&](const store::EventView& /*row*/) {
                ++events;
                return true;
              })
      .map([&] { return events; });
}

Error is_there(const std::string& file) {
  Error error{.code = Errc::usage,
              .message = "this file exists already",
              .hint = "choose another name, or add --force to replace it"};
  error.name = file;
  return error;
}

/// The old copy stays until the new one is whole.
Result<void> replace(store::Reader& reader, const std::string& file) {
  const std::string part = file + ".part";
  std::error_code failed;
  std::filesystem::remove(part, failed);
  TRY(reader.backup(part));
  std::filesystem::rename(part, file, failed);
  if (!failed) return {};
  Error error{.code = Errc::storage,
              .message = fmt::format("cannot be replaced: {}", failed.message()),
              .hint = fmt::format("the new copy is {}", part)};
  error.name = file;
  return tl::unexpected(std::move(error));
}

}  // namespace

Result<Outcome> trim_store(const TrimOptions& options, Context& context) {
  auto before = parse_time(options.before, context.clock);
  if (!before) {
    before.error().name = "--before";
    return tl::unexpected(std::move(before.error()));
  }
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  auto reader = store::Reader::open(path);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  TRY_LET(auto writer, store::Writer::open(path));
  TRY_LET(const auto older, count_older(**reader, *before));
  reader->reset();  // a reader holds back what is to be removed
  const std::string what =
      fmt::format("trim removes {} from before {} for ever, but for the last of each tool",
                  counted(older, "event"), to_local_text(*before, context.clock));
  TRY(ask_consent(what, context));
  TRY_LET(const auto trimmed, writer->trim(*before, context.clock.wall()));
  Outcome outcome;
  outcome.succeed();
  return tell({.counts = {{"before", report::to_text(*before)},
                          {"events", count(trimmed.events)},
                          {"gaps", count(trimmed.gaps)},
                          {"happenings", count(trimmed.happenings)}},
               .sentence = fmt::format("{}, {} and {} removed", counted(trimmed.events, "event"),
                                       counted(trimmed.gaps, "gap"),
                                       counted(trimmed.happenings, "happening"))},
              outcome, context)
      .map([&] { return outcome; });
}

Result<Outcome> backup_store(const CopyOptions& options, Context& context) {
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  TRY_LET(auto reader, store::Reader::open(path));
  const bool is_itself = context.disk.same_file(path, options.file);
  const bool is_taken = context.disk.exists(options.file);
  if (is_itself || (is_taken && options.overwrite == Overwrite::refuse)) {
    Error error = is_there(options.file);
    if (is_itself) error.message = "this is the store itself";
    if (is_itself) error.hint = "choose another name";
    return tl::unexpected(std::move(error));
  }
  auto copied = is_taken ? replace(*reader, options.file) : reader->backup(options.file);
  if (!copied) return tl::unexpected(std::move(copied.error()));
  Outcome outcome;
  outcome.succeed();
  return tell({.counts = {{"file", options.file}},
               .sentence = fmt::format("copied to {}", options.file)},
              outcome, context)
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
