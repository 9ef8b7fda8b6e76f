#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "spindle/catalogue/event_layout.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/report/record.hpp"
#include "spindle/store/writer.hpp"
#include "spindle/work/event_rows.hpp"

namespace spindle::test {

/// Writes a store as `record` would, from what tools are said to have told.
class StoreMaker {
 public:
  using Values = std::map<std::string, std::uint16_t>;  ///< raw, by the names of the profile

  /// `profiles` must outlive it.
  StoreMaker(const std::string& path, const files::ProfileStore& profiles) : profiles_(&profiles) {
    auto writer = store::Writer::open(path);
    if (!writer) throw std::runtime_error(describe(writer.error()));
    writer_ = std::move(*writer);
  }

  /// A tool that tells what follows. Its profile may be one that is not known.
  void connect(const std::string& name, const std::string& serial, const std::string& profile,
               const std::string& torque_unit = "N.m") {
    serial_ = serial;
    name_ = name;
    tool_ = writer_->tool({.maker = "DOGA", .serial = serial}, "3204").value();
    place_ = writer_
                 ->place({.tool = tool_,
                          .name = name,
                          .url = "tcp://" + name,
                          .profile = profile,
                          .firmware = 2103,
                          .torque_unit = torque_unit,
                          .since = now_})
                 .value();
    auto known = profiles_->load(profile);
    profile_ = known ? std::make_unique<catalogue::Profile>(std::move(*known)) : nullptr;
  }

  void wait(std::chrono::milliseconds time) { now_ += time; }
  [[nodiscard]] WallTime now() const { return now_; }

  /// An event of a known profile. The text stands at the beginning of the block.
  void tell(std::uint16_t number, const Values& values, const std::string& source = "push",
            bool remembered = false, const std::string& text = {}) {
    const catalogue::EventLayout layout(*profile_);
    Registers block(profile_->events->count);
    for (std::size_t at = 0; at < text.size(); ++at) {
      const auto byte = static_cast<std::uint8_t>(text[at]);
      block[at / 2] = static_cast<std::uint16_t>(block[at / 2] | (at % 2 == 0 ? byte << 8 : byte));
    }
    for (const auto& field : layout.fields()) {
      const auto value = values.find(field.key);
      if (value != values.end()) block[field.at] = value->second;
      if (field.key == "number") block[field.at] = number;
    }
    device::ToolEvent news{
        .source = device::EventOrigin::push,
        .block = std::move(block),
        .time = now_,
        .standing = remembered ? device::Standing::first : device::Standing::result,
        .number = number};
    store::Event row = work::EventRows(*profile_).row(news);
    row.source = source;
    add(std::move(row));
  }

  /// An event as a row, but for tool and place.
  void tell_row(store::Event row) { add(std::move(row)); }

  /// An event of which nothing but its columns is understood.
  void tell_strange(std::uint16_t number, const std::string& kind, std::int64_t torque) {
    store::Event row{.number = number, .at = now_, .source = "push", .kind = kind, .raw = {1, 2}};
    row.columns[store::Column::torque] = torque;
    row.columns[store::Column::preset] = 1;
    add(std::move(row));
  }

  /// An event of which not even the bytes were kept.
  void tell_nothing(std::uint16_t number) {
    add({.number = number, .at = now_, .source = "push", .kind = "other"});
  }

  /// Numbers were missed before the next event.
  void miss(std::uint16_t after, std::uint16_t before, const std::string& reason) {
    gap_ = store::Gap{.after = after,
                      .before = before,
                      .missed = static_cast<std::uint32_t>(before - after - 1),
                      .began = now_,
                      .ended = now_,
                      .reason = reason};
  }
  /// More than is known, without an event behind it.
  void lose(const std::string& reason) {
    store::Gap gap{.tool = tool_, .began = now_, .ended = now_, .reason = reason};
    commit(store::NewGap{std::move(gap)});
  }

  void settle(std::int64_t preset, std::int64_t target, std::int64_t limit, std::int64_t most) {
    store::PresetSettings settings{.tool = tool_, .preset = preset, .since = now_};
    settings[store::Setting::target_torque] = target * 100;
    settings[store::Setting::torque_limit] = limit * 10'000;
    settings[store::Setting::max_angle] = most;
    commit(std::move(settings));
  }

  void happen(report::Record record) {
    record.target = name_;
    record.time = now_;
    commit(store::Happening{
        .tool = tool_, .at = now_, .type = record.type, .json = report::to_json(record)});
  }

  void say_total(std::int64_t total, std::optional<std::int64_t> number) {
    happen({.type = "total",
            .target = {},
            .time = {},
            .fields = {{"serial", serial_},
                       {"total", report::number(total)},
                       {"epoch", number ? report::number(0) : report::Cell()},
                       {"number", number ? report::number(*number) : report::Cell()}}});
  }

 private:
  void add(store::Event row) {
    row.tool = tool_;
    row.place = place_;
    commit(store::NewEvent{.event = std::move(row), .gap = std::exchange(gap_, std::nullopt)});
  }

  void commit(store::Entry entry) {
    const std::vector<store::Entry> entries = {std::move(entry)};
    const auto stored = writer_->commit(entries);
    if (!stored) throw std::runtime_error(describe(stored.error()));
  }

  const files::ProfileStore* profiles_;
  std::unique_ptr<store::Writer> writer_ = {};
  std::unique_ptr<const catalogue::Profile> profile_ = {};
  WallTime now_ = WallTime(std::chrono::milliseconds(1'795'334'400'000));  ///< 08:00 UTC
  store::RowId tool_ = 0;
  store::RowId place_ = 0;
  std::string name_ = {};
  std::string serial_ = {};
  std::optional<store::Gap> gap_ = std::nullopt;
};

/// Two screwdrivers, one of another make with a code that was scanned, and one whose profile is not
/// known any more; all on 2026-11-22 from 08:00 UTC.
inline void make_sample_store(const std::string& path, const files::ProfileStore& profiles) {
  using namespace std::chrono_literals;
  StoreMaker maker(path, profiles);
  const auto screw = [](std::uint16_t preset, std::uint16_t torque, std::uint16_t status,
                        std::uint16_t error = 0) {
    return StoreMaker::Values{{"preset", preset},      {"target_torque", 271}, {"torque", torque},
                              {"fastening_time", 412}, {"speed", 1000},        {"a3", 6301},
                              {"status", status},      {"error", error}};
  };
  maker.connect("station1", "1021100042", "doga-bm");
  maker.happen({.type = "link",
                .target = {},
                .time = {},
                .fields = {{"state", std::string("connected")},
                           {"attempt", report::number(1)},
                           {"message", std::string("events are pushed")}}});
  maker.say_total(5000, std::nullopt);
  maker.settle(1, 271, 10, 7000);
  maker.tell(1962, screw(1, 270, 1), "catch-up", true);
  maker.wait(1s);
  maker.tell(1963, screw(1, 272, 1));
  maker.wait(1s);
  maker.tell(1964, screw(1, 269, 1));
  maker.wait(3s);
  maker.miss(1964, 1967, "events were missed");
  maker.tell(1967, screw(1, 310, 2, 335));
  maker.wait(1s);
  maker.tell(1968, screw(1, 80, 2, 333));
  maker.connect("station2", "1021100043", "doga-bm");
  maker.wait(500ms);
  maker.tell(10, screw(2, 271, 1));
  maker.wait(1h);
  maker.lose("the link was lost, and the tool counts anew");
  maker.tell(11, screw(2, 271, 1));
  maker.connect("station1", "1021100042", "doga-bm");
  maker.say_total(5006, 1968);
  maker.settle(1, 280, 10, 7000);
  maker.wait(1s);
  maker.tell(1969, screw(1, 0, 4));
  maker.wait(1s);
  maker.tell(1970, screw(1, 281, 1));
  maker.connect("press", "@press", "kolver-kducer", "");
  maker.tell(1, {{"ok", 1}, {"program", 3}, {"torque", 271}, {"angle", 90}}, "poll", false,
             "=cmd|\"a,b\"\n\x1b[2J");
  maker.connect("old", "17", "gone-tool");
  maker.wait(1s);
  maker.tell_strange(7, "fastening-ng", 12'345);
}

/// One with a hole and a row that has lost its bytes.
inline void make_damaged_store(const std::string& path, const files::ProfileStore& profiles) {
  StoreMaker maker(path, profiles);
  maker.connect("station1", "1021100042", "doga-bm");
  maker.tell(1, {{"status", 1}});
  maker.tell(4, {{"status", 1}});
  maker.tell_nothing(5);
}

}  // namespace spindle::test
