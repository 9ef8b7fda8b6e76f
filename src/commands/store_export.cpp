#include <fmt/format.h>

#include <utility>

#include "backup_paths.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "result_selection.hpp"
#include "result_stream.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "stored_curves.hpp"
#include "stored_records.hpp"

namespace spindle::commands {
namespace {

using report::Cell;
using report::Record;

/// JSON Lines on their way to a file or to standard output. Remembers the first failure.
class LineSink {
 public:
  LineSink(const CopyOptions& options, Context& context)
      : file_(options.file == standard_output ? std::string() : options.file), context_(&context) {
    if (file_.empty()) return;
    written_ = context.disk.write(file_, "", options.overwrite, Privacy::usual);
    if (written_) return;
    if (written_.error().name.empty()) written_.error().name = file_;
    if (written_.error().code == Errc::usage) {
      written_.error().hint = "choose another name, or add --force to replace it";
    }
  }

  bool add(const Record& record) {
    text_ += report::to_json(record);
    text_ += '\n';
    ++records_;
    return text_.size() < part_size || flush();
  }

  bool flush() {
    if (!written_ || text_.empty()) return written_.has_value();
    written_ = file_.empty() ? context_->io.out(text_) : context_->disk.append(file_, text_);
    text_.clear();
    return written_.has_value();
  }

  [[nodiscard]] const Result<void>& written() const { return written_; }
  [[nodiscard]] std::size_t records() const { return records_; }

 private:
  static constexpr std::size_t part_size = 1U << 18U;

  std::string file_;
  Context* context_;
  std::string text_ = {};
  std::size_t records_ = 0;
  Result<void> written_ = {};
};

std::string serial_of(const StoredRecords& records, store::RowId id) {
  const store::Tool* tool = records.tool(id);
  return tool == nullptr ? std::string() : tool->name.serial;
}

Record place_record(const store::Place& place, const StoredRecords& records) {
  const store::Tool* tool = records.tool(place.tool);
  const store::Tool known = tool == nullptr ? store::Tool() : *tool;
  return {.type = "place",
          .target = place.name,
          .time = place.since,
          .fields = {{"maker", text_or_null(known.name.maker)},
                     {"serial", text_or_null(known.name.serial)},
                     {"tool_model", text_or_null(known.model)},
                     {"endpoint", place.url},
                     {"profile", place.profile},
                     {"firmware", place.firmware ? number(*place.firmware) : Cell()},
                     {"torque_unit", text_or_null(place.torque_unit)},
                     {"seen", place.seen ? Cell(report::to_text(*place.seen)) : Cell()}}};
}

Record epoch_record(const store::Epoch& epoch, const StoredRecords& records) {
  const store::Place* place = records.place_at(epoch.tool, epoch.began);
  return {.type = "epoch",
          .target = place == nullptr ? std::string() : place->name,
          .time = epoch.began,
          .fields = {{"serial", text_or_null(serial_of(records, epoch.tool))},
                     {"epoch", number(epoch.ordinal)},
                     {"reason", std::string(store::epoch_reason_words.text(epoch.reason))}}};
}

Record preset_record(const store::PresetSettings& settings, const StoredRecords& records) {
  const store::Place* place = records.place_at(settings.tool, settings.since);
  Record record{.type = "preset",
                .target = place == nullptr ? std::string() : place->name,
                .time = settings.since,
                .fields = {{"serial", text_or_null(serial_of(records, settings.tool))},
                           {"preset", number(settings.preset)}}};
  for (const auto& [word, setting] : store::setting_words) {
    const bool is_fine =
        setting == store::Setting::target_torque || setting == store::Setting::torque_limit;
    const auto& value = settings[setting];
    Cell cell;
    if (value) cell = is_fine ? in_units(*value) : Decimal(*value);
    record.fields.push_back({std::string(word), std::move(cell)});
  }
  return record;
}

/// Behind all events: each names its own by serial number, epoch and number.
Result<void> add_curves(store::Reader& reader, LineSink& sink) {
  return reader.curves(0, [&](const store::Curve& row) {
    const auto curve = stored_curve(row);
    return !curve || sink.add(curve_record(*curve));
  });
}

Result<void> add_all(store::Reader& reader, StoredRecords& records, LineSink& sink) {
  for (const store::Place& place : records.places()) sink.add(place_record(place, records));
  TRY_LET(const auto epochs, reader.epochs());
  for (const store::Epoch& epoch : epochs) sink.add(epoch_record(epoch, records));
  TRY_LET(const auto settings, reader.settings());
  for (const auto& row : settings) sink.add(preset_record(row, records));
  const Selection all;
  ResultStream stream(reader, records, all, Told::all, std::nullopt);
  TRY(stream.tell_new([&](const Record& record) { return sink.add(record); }));
  return add_curves(reader, sink);
}

}  // namespace

Result<Outcome> export_store(const CopyOptions& options, Context& context) {
  if (context.user.format == report::Format::csv || context.user.format == report::Format::yaml) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "an export is JSON Lines",
                                .hint = "'spindle results -o csv' writes a table of the results"});
  }
  TRY_LET(auto reader, open_store(options.store, context));
  ProfileShelf shelf(context.profiles);
  auto records = StoredRecords::make(*reader, shelf, context);
  if (!records) return tl::unexpected(std::move(records.error()));
  LineSink sink(options, context);
  if (sink.written()) {
    auto read = add_all(*reader, *records, sink);
    sink.flush();
    if (!read) return tl::unexpected(std::move(read.error()));
  }
  if (!sink.written()) return tl::unexpected(sink.written().error());
  Outcome outcome;
  outcome.succeed();
  return tell({.counts = {{"records", count(sink.records())}},
               .sentence = counted(sink.records(), "record") + " exported"},
              outcome, context)
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
