#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "spindle/store/writer.hpp"

namespace spindle::test {

/// Numbers that look random and are the same on every computer.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed) {}

  double uniform() {
    state_ = state_ * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
    return static_cast<double>(state_ >> 11U) / 9'007'199'254'740'992.0;
  }
  /// About normal: the sum of twelve uniform ones.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

 private:
  std::uint64_t state_;
};

/// Writes the shift of a line as `record` would have stored it.
class ReportStore {
 public:
  explicit ReportStore(const std::string& path, WallTime begin = first()) : now_(begin) {
    auto writer = store::Writer::open(path);
    if (!writer) throw std::runtime_error(describe(writer.error()));
    writer_ = std::move(*writer);
  }

  /// 2026-11-30 06:00 UTC.
  static WallTime first() { return WallTime(std::chrono::seconds(1'796'018'400)); }

  void connect(const std::string& name, const std::string& serial, std::uint32_t firmware = 2103) {
    tool_ = writer_->tool({.maker = "DOGA", .serial = serial}, "BM-3204").value();
    place_ = writer_
                 ->place({.tool = tool_,
                          .name = name,
                          .url = "tcp://192.168.10.23",
                          .profile = "doga-bm",
                          .firmware = firmware,
                          .torque_unit = "N.m",
                          .since = now_})
                 .value();
    number_ = 1000;
  }

  /// Settings of a preset: target in hundredths, limit in percent, angles.
  void set(std::int64_t preset, std::int64_t target, std::int64_t percent,
           std::int64_t min_angle = 0, std::int64_t max_angle = 0) {
    store::PresetSettings settings{.tool = tool_, .preset = preset, .since = now_};
    settings[store::Setting::target_torque] = target * 100;
    settings[store::Setting::torque_limit] = percent * 10'000;
    settings[store::Setting::mode] = 0;
    settings[store::Setting::target_angle] = 0;
    settings[store::Setting::min_angle] = min_angle;
    settings[store::Setting::max_angle] = max_angle;
    flush();
    add(settings);
    preset_ = preset;
    target_ = target;
  }

  void select(std::int64_t preset, std::int64_t target) {
    preset_ = preset;
    target_ = target;
  }

  /// A rundown: torque in hundredths; error 0 is OK.
  void result(std::int64_t torque, std::int64_t angle, std::int64_t error = 0) {
    event(error == 0 ? "fastening-ok" : "fastening-ng", torque, angle, error);
  }
  void loosening() { event("fastening-ok", 120, 900, 0, 1); }
  void other(const std::string& kind) { event(kind, 0, 0, 0); }

  void wait(std::chrono::milliseconds time) { now_ += time; }
  [[nodiscard]] WallTime now() const { return now_; }
  [[nodiscard]] std::uint16_t number() const { return number_; }

  /// So many events are missing before the next one.
  void miss(std::uint16_t events) {
    gap_ = store::Gap{.tool = tool_,
                      .after = number_,
                      .before = static_cast<std::uint16_t>(number_ + events + 1),
                      .missed = events,
                      .began = now_,
                      .ended = now_,
                      .reason = "the link was lost"};
    number_ = static_cast<std::uint16_t>(number_ + events);
  }

  void flush() {
    if (entries_.empty()) return;
    auto stored = writer_->commit(entries_);
    if (!stored) throw std::runtime_error(describe(stored.error()));
    entries_.clear();
  }

 private:
  void event(const std::string& kind, std::int64_t torque, std::int64_t angle, std::int64_t error,
             std::int64_t direction = 0) {
    store::NewEvent entry;
    if (number_ == 65'535) entry.begins = store::EpochReason::wrap;
    ++number_;
    entry.event = {.tool = tool_,
                   .place = place_,
                   .number = number_,
                   .at = now_,
                   .source = "push",
                   .kind = kind,
                   .raw = {number_, static_cast<std::uint16_t>(torque)}};
    using store::Column;
    store::Columns& columns = entry.event.columns;
    columns[Column::preset] = preset_;
    columns[Column::target_torque] = target_ * 100;
    columns[Column::torque] = torque * 100;
    columns[Column::a3] = angle;
    columns[Column::error] = error;
    columns[Column::direction] = direction;
    if (gap_) {
      gap_->ended = now_;
      entry.gap = std::exchange(gap_, std::nullopt);
    }
    add(entry);
  }

  void add(store::Entry entry) {
    entries_.push_back(std::move(entry));
    if (entries_.size() >= 5'000) flush();
  }

  std::unique_ptr<store::Writer> writer_;
  WallTime now_;
  store::RowId tool_ = 0;
  store::RowId place_ = 0;
  std::uint16_t number_ = 1000;
  std::int64_t preset_ = 1;
  std::int64_t target_ = 271;
  std::optional<store::Gap> gap_ = std::nullopt;
  std::vector<store::Entry> entries_ = {};
};

/// How a rundown of a made shift comes out.
struct MadeProcess {
  double mean = 271;
  double sigma = 3;
  double low = 244;  ///< what the tool judges by
  double high = 298;
  double angle = 6300;
  double angle_sigma = 42;
  double aborted = 0;  ///< share of rundowns that were not completed
};

inline void drive(ReportStore& store, Noise& noise, const MadeProcess& process,
                  std::chrono::milliseconds every) {
  constexpr std::array codes = {333, 333, 333, 333, 334, 334, 300, 331, 336, 339};
  const auto angle = std::llround(process.angle + noise.normal() * process.angle_sigma);
  if (noise.uniform() < process.aborted) {
    const auto code = codes[static_cast<std::size_t>(noise.uniform() * codes.size())];
    store.result(std::llround(process.mean * (0.2 + noise.uniform() * 0.6)),
                 std::llround(static_cast<double>(angle) * noise.uniform()), code);
  } else {
    const double torque = std::round(process.mean + noise.normal() * process.sigma);
    const bool is_ok = torque >= process.low && torque <= process.high;
    store.result(std::llround(torque), angle, is_ok ? 0 : 335);
  }
  store.wait(every);
}

/// Three tools and two presets: a shifted mean, changed settings, a gap, many NG of several codes.
inline void make_shift(const std::string& path) {
  using std::chrono::milliseconds;
  ReportStore store(path);
  Noise noise(7);
  store.connect("station3", "1021100042");
  store.set(1, 271, 10, 5900, 6700);
  MadeProcess screw{.aborted = 0.03};
  for (int i = 0; i < 1200; ++i) {
    screw.mean = i >= 500 && i < 620 ? 275.5 : 271;
    if (i == 300) store.miss(12);
    if (i == 800) store.wait(std::chrono::minutes(45));
    if (i % 150 == 149) store.loosening();
    drive(store, noise, screw, milliseconds(12'000));
  }
  store.set(1, 280, 8, 5900, 6700);
  screw = {.mean = 280, .sigma = 3.2, .low = 258, .high = 302, .aborted = 0.02};
  for (int i = 0; i < 700; ++i) drive(store, noise, screw, milliseconds(12'000));
  store.flush();

  store.connect("station4", "1021100043");
  store.wait(-std::chrono::hours(6));
  store.set(1, 271, 10);
  store.set(2, 150, 12);
  const MadeProcess wide{.sigma = 9, .angle = 5200, .angle_sigma = 120, .aborted = 0.08};
  const MadeProcess small{.mean = 151,
                          .sigma = 2.2,
                          .low = 132,
                          .high = 168,
                          .angle = 2400,
                          .angle_sigma = 30,
                          .aborted = 0.01};
  for (int i = 0; i < 1800; ++i) {
    const bool is_small = i % 3 == 2;
    store.select(is_small ? 2 : 1, is_small ? 150 : 271);
    drive(store, noise, is_small ? small : wide, milliseconds(11'000));
  }
  store.flush();

  store.connect("press <b>&\"7\"", "1021100051");
  store.wait(-std::chrono::hours(1));
  store.set(1, 271, 10);
  for (int i = 0; i < 41; ++i) drive(store, noise, {}, milliseconds(60'000));
  store.flush();
}

/// So many results of one tool.
inline void make_many(const std::string& path, std::size_t results) {
  ReportStore store(path);
  Noise noise(11);
  store.connect("station3", "1021100042");
  store.set(1, 271, 10);
  MadeProcess screw{.aborted = 0.01};
  for (std::size_t i = 0; i < results; ++i) {
    screw.mean = i > results / 2 && i < results / 2 + results / 20 ? 273 : 271;
    drive(store, noise, screw, std::chrono::milliseconds(5'000));
  }
  store.flush();
}

}  // namespace spindle::test
