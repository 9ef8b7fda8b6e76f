#include <fmt/format.h>

#include <array>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "postgres_address.hpp"
#include "postgres_batch.hpp"
#include "postgres_connection.hpp"
#include "postgres_tables.hpp"
#include "spindle/base/text.hpp"
#include "spindle/forward/sink.hpp"

namespace spindle::forward {
namespace {

constexpr Duration connect_limit = std::chrono::seconds(12);  // behind libpq's own of each host
/// For a statement of a batch, whatever the server does meanwhile.
constexpr Duration answer_limit = std::chrono::seconds(20);
constexpr std::size_t usual_batch = 500;

using Parcels = std::vector<const Parcel*>;
using Done = tl::expected<void, PostgresRefusal>;

PostgresRefusal no_refusal(Error error) { return {.error = std::move(error)}; }

std::string_view kind_of(const Parcel& parcel) {
  if (parcel.event() != nullptr) return "event";
  return parcel.gap() != nullptr ? "gap" : "happening";
}

class PostgresSink final : public Sink {
 public:
  PostgresSink(SinkMeans means, std::vector<PostgresAddress> addresses)
      : means_(std::move(means)), addresses_(std::move(addresses)) {}

  Result<void> connect(const Greeting& greeting) override;
  [[nodiscard]] bool wants(const Parcel& parcel) const override {
    if (parcel.event() == nullptr) return true;
    return means_.settings.events != files::SinkEvents::results || parcel.is_result;
  }
  [[nodiscard]] std::size_t window() const override {
    return means_.settings.batch.value_or(usual_batch);
  }
  [[nodiscard]] std::string place_of(const Parcel& parcel) const override {
    return fmt::format("spindle_{}", kind_of(parcel));
  }
  Result<std::size_t> deliver(std::span<const Parcel> parcels, Duration patience) override;
  Result<void> idle(Duration time) override;
  void close() override { connection_.reset(); }

 private:
  Result<void> open(const PostgresAddress& address);
  Done transact(const Parcels& parcels);
  Done insert(const Parcels& parcels);
  Done insert_all_events(const Parcels& parcels);
  Done settle_known(const Parcels& parcels, const std::set<std::string>& inserted);
  Done put_aside(const Parcel& parcel, const std::string& reason);
  Done refuse(const Parcel& parcel, const PostgresRefusal& refusal);
  Done ask(const char* statement, const PostgresValues& values);
  [[nodiscard]] TimePoint deadline() const { return means_.clock.now() + answer_limit; }

  SinkMeans means_;
  std::vector<PostgresAddress> addresses_;
  std::size_t last_good_ = 0;
  std::set<std::string> cautions_ = {};
  std::optional<PostgresConnection> connection_ = std::nullopt;
};

Result<void> PostgresSink::connect(const Greeting&) {
  connection_.reset();
  std::optional<Error> failure;
  for (std::size_t tried = 0; tried < addresses_.size(); ++tried) {
    const std::size_t index = (last_good_ + tried) % addresses_.size();
    auto opened = open(addresses_[index]);
    if (opened) {
      last_good_ = index;
      return {};
    }
    connection_.reset();
    failure = std::move(opened.error());
    if (means_.interrupt.raised()) break;
  }
  return tl::unexpected(failure.value_or(Error{.code = Errc::usage, .message = "no URL is given"}));
}

Result<void> PostgresSink::open(const PostgresAddress& address) {
  if (!address.caution.empty() && cautions_.insert(address.shown).second) {
    means_.note(address.caution);
  }
  TRY_LET(auto connection,
          PostgresConnection::open(address, connect_limit, means_.clock, means_.interrupt));
  connection_.emplace(std::move(connection));
  return prepare_session(*connection_, deadline());
}

Result<std::size_t> PostgresSink::deliver(std::span<const Parcel> parcels, Duration /*patience*/) {
  if (!connection_) {
    return tl::unexpected(Error{.code = Errc::closed, .message = "the database is not connected"});
  }
  Parcels all;
  for (const Parcel& parcel : parcels) all.push_back(&parcel);
  auto done = transact(all);
  if (done) return parcels.size();
  return tl::unexpected(std::move(done.error().error));
}

/// One transaction. Where the database refuses a row, each half of them is one, until that row is
/// alone and put aside.
Done PostgresSink::transact(const Parcels& parcels) {
  auto done = ask("BEGIN ISOLATION LEVEL READ COMMITTED", {});
  if (done) done = insert(parcels);
  if (done) done = ask("COMMIT", {});
  if (done || !done.error().is_about_row()) return done;
  const PostgresRefusal refusal = std::move(done.error());
  done = ask("ROLLBACK", {});
  if (!done) return done;
  if (parcels.size() == 1) return refuse(*parcels.front(), refusal);
  const auto middle = parcels.begin() + static_cast<std::ptrdiff_t>(parcels.size() / 2);
  done = transact({parcels.begin(), middle});
  if (done) done = transact({middle, parcels.end()});
  return done;
}

Done PostgresSink::insert(const Parcels& parcels) {
  Parcels events;
  Parcels gaps;
  Parcels happenings;
  for (const Parcel* parcel : parcels) {
    if (parcel->event() != nullptr) events.push_back(parcel);
    if (parcel->gap() != nullptr) gaps.push_back(parcel);
    if (parcel->happening() != nullptr) happenings.push_back(parcel);
  }
  Done done;
  if (!events.empty()) done = insert_all_events(events);
  if (done && !gaps.empty()) done = ask(insert_gaps, gap_values(gaps, means_.collector));
  if (done && !happenings.empty()) {
    done = ask(insert_happenings, happening_values(happenings, means_.collector));
  }
  return done;
}

Done PostgresSink::insert_all_events(const Parcels& parcels) {
  const auto rows =
      connection_->ask(insert_events, event_values(parcels, means_.collector), deadline());
  if (!rows) return tl::unexpected(rows.error());
  if (static_cast<std::size_t>(rows->size()) == parcels.size()) return {};
  std::set<std::string> inserted;
  for (int row = 0; row < rows->size(); ++row) inserted.insert(*rows->text(row, 0));
  return settle_known(parcels, inserted);
}

/// Behind every event that was not inserted has to stand the very same one.
Done PostgresSink::settle_known(const Parcels& parcels, const std::set<std::string>& inserted) {
  std::map<std::string, const Parcel*> known;
  std::array<PostgresArray, 6> keys;
  for (const Parcel* parcel : parcels) {
    const std::string id = fmt::format("{}", parcel->id);
    if (inserted.contains(id)) continue;
    known.emplace(id, parcel);
    keys[0].add(clean_text(parcel->tool.maker).text);
    keys[1].add(clean_text(parcel->tool.serial).text);
    keys[2].add(parcel->epoch);
    keys[3].add(std::int64_t{parcel->event()->number});
    keys[4].add_bytes(parcel->event()->raw);
    keys[5].add(parcel->id);
  }
  PostgresValues values;
  for (PostgresArray& array : keys) values.emplace_back(std::move(array).take());
  const auto rows = connection_->ask(compare_events, values, deadline());
  if (!rows) return tl::unexpected(rows.error());
  for (int row = 0; row < rows->size(); ++row) {
    if (!rows->truth(row, 2)) continue;
    const auto found = known.find(rows->text(row, 0).value_or(""));
    if (found == known.end()) continue;
    auto done =
        put_aside(*found->second, rows->truth(row, 1) ? "another event has this key"
                                                      : "another unique key of the table has it");
    if (!done) return done;
  }
  return {};
}

/// Within a transaction.
Done PostgresSink::put_aside(const Parcel& parcel, const std::string& reason) {
  const std::string name = key_of(parcel);
  const std::string key =
      name.empty() ? fmt::format("{}/{}", means_.collector, parcel.id) : clean_text(name).text;
  std::string raw = "\\x";
  if (const auto* event = parcel.event()) {
    for (const std::uint16_t word : event->raw) raw += fmt::format("{:04x}", word);
  }
  const auto rows =
      connection_->ask(insert_conflict,
                       {key, std::string(kind_of(parcel)), reason, clean_json(parcel.json).text,
                        raw, means_.collector, fmt::format("{}", parcel.id)},
                       deadline());
  if (!rows) return tl::unexpected(rows.error());
  if (rows->size() == 0) return {};
  means_.fault(Error{
      .code = Errc::mismatch,
      .message = fmt::format("{} {} could not become a row: {}", kind_of(parcel), key, reason),
      .hint = "it is kept in the table spindle_conflict; see what it is",
      .target = parcel.target});
  return {};
}

/// A row that the database refuses must not stop all others.
Done PostgresSink::refuse(const Parcel& parcel, const PostgresRefusal& refusal) {
  auto done = ask("BEGIN ISOLATION LEVEL READ COMMITTED", {});
  if (done) done = put_aside(parcel, message_of(refusal.error));
  if (done) done = ask("COMMIT", {});
  if (!done && done.error().is_about_row()) {
    // Nothing is left where it could be put.
    return tl::unexpected(no_refusal(std::move(done.error().error)));
  }
  return done;
}

Done PostgresSink::ask(const char* statement, const PostgresValues& values) {
  auto rows = connection_->ask(statement, values, deadline());
  if (!rows) return tl::unexpected(std::move(rows.error()));
  return {};
}

Result<void> PostgresSink::idle(Duration time) {
  if (!connection_) return {};
  return connection_->listen(means_.clock.now() + time);
}

}  // namespace

Result<std::unique_ptr<Sink>> make_postgres_sink(SinkMeans means) {
  TRY_LET(auto addresses, postgres_addresses(means.settings, means.password));
  return std::make_unique<PostgresSink>(std::move(means), std::move(addresses));
}

}  // namespace spindle::forward
