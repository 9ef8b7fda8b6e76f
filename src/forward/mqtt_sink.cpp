#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mqtt_client.hpp"
#include "mqtt_topics.hpp"
#include "mqtt_words.hpp"
#include "spindle/base/json.hpp"
#include "spindle/forward/sink.hpp"

namespace spindle::forward {
namespace {

constexpr std::size_t usual_window = 100;
constexpr int first_refusal = 128;
/// Some brokers end a connection behind the message that they refuse, and what was sent meanwhile
/// hides the reason. So the first messages of a connection go out one by one, and a window of them
/// where the connection before broke with some on their way.
constexpr std::size_t first_messages = 8;
constexpr Duration accept_limit = std::chrono::seconds(8);
/// A broker that is well acknowledges in milliseconds; one that writes each message to its disk, in
/// seconds.
constexpr Duration answer_limit = std::chrono::seconds(30);
constexpr Duration farewell = std::chrono::seconds(2);

std::string client_id_of(const files::Sink& settings, const std::string& collector) {
  if (!settings.client_id.empty()) return settings.client_id;
  return level_of(fmt::format("spindle-{}-{}", collector, settings.name));
}

std::string status_offline() { return R"({"online":false})"; }

std::string status_online(const Greeting& greeting, std::string_view version) {
  std::string json = R"({"online":true,"version":)";
  append_json_string(json, version);
  json += R"(,"tools":[)";
  std::string_view separator;
  for (const std::string& target : greeting.targets) {
    json += std::exchange(separator, ",");
    append_json_string(json, target);
  }
  return json + fmt::format(R"(],"first":{},"last":{}}})", greeting.first, greeting.last);
}

class MqttSink final : public Sink {
 public:
  MqttSink(SinkMeans means, std::vector<MqttClient::Settings> brokers)
      : means_(std::move(means)), brokers_(std::move(brokers)) {
    for (const auto& broker : brokers_) topics_.emplace_back(broker.url.base);
  }

  Result<void> connect(const Greeting& greeting) override;
  [[nodiscard]] bool wants(const Parcel& parcel) const override;
  [[nodiscard]] std::size_t window() const override {
    return means_.settings.window.value_or(usual_window);
  }
  Result<std::size_t> deliver(std::span<const Parcel> parcels, Duration patience) override;
  [[nodiscard]] bool tells_states() const override { return true; }
  Result<void> tell_states(std::span<const ToolState> states) override;
  Result<void> idle(Duration time) override;
  void close() override;
  [[nodiscard]] std::string place_of(const Parcel& parcel) const override {
    return topic_of(parcel);
  }

 private:
  /// A parcel that was sent; what is acknowledged waits for those before it.
  struct Sent {
    int message = 0;
    bool is_acknowledged = false;
  };

  Result<void> open(std::size_t index, const Greeting& greeting);
  void forget_flight();
  [[nodiscard]] std::string topic_of(const Parcel& parcel) const;
  [[nodiscard]] std::size_t limit() const;
  Result<void> send(std::span<const Parcel> parcels);
  Result<void> send_states();
  Result<void> send_other(const MqttMessage& message);
  Result<void> take_answers(std::span<const Parcel> parcels);
  Result<void> check_answer(const MqttAnswer& answer, std::span<const Parcel> parcels);
  std::size_t take_acknowledged();
  [[nodiscard]] Error refused(const std::string& topic, int reason) const;

  SinkMeans means_;
  std::vector<MqttClient::Settings> brokers_;
  std::vector<Topics> topics_ = {};  ///< of each broker
  std::size_t broker_ = 0;           ///< the one that worked last
  std::unique_ptr<MqttClient> client_ = nullptr;
  std::deque<Sent> flight_ = {};                    ///< of the front of what is to be delivered
  TimePoint answered_at_ = {};                      ///< when something was acknowledged, or began
  std::map<int, std::string> others_ = {};          ///< topics of what else was sent
  std::map<std::string, std::string> states_ = {};  ///< that wait, by target
  std::size_t careful_ = 0;                         ///< messages that go one by one
  bool was_cut_ = false;  ///< the connection before, with some on their way
  std::set<std::string, std::less<>> refused_ =
      {};  ///< topics of what need not arrive; told, and left out
};

/// In turn, from the one that worked last.
Result<void> MqttSink::connect(const Greeting& greeting) {
  std::optional<Error> failure;
  for (std::size_t tried = 0; tried < brokers_.size(); ++tried) {
    const std::size_t index = (broker_ + tried) % brokers_.size();
    auto opened = open(index, greeting);
    if (opened) {
      broker_ = index;
      return {};
    }
    client_.reset();
    if (!failure) failure = std::move(opened.error());
    if (means_.interrupt.raised()) return tl::unexpected(means_.interrupt.error());
  }
  return tl::unexpected(std::move(*failure));
}

Result<void> MqttSink::open(std::size_t index, const Greeting& greeting) {
  forget_flight();
  const MqttClient::Settings& broker = brokers_[index];
  TRY(means_.reach(broker.url.host, broker.url.port));
  TRY_LET(client_, MqttClient::make(broker, means_.clock, means_.interrupt));
  TRY(client_->connect(accept_limit));
  answered_at_ = means_.clock.now();
  careful_ = std::exchange(was_cut_, false) ? std::max(window(), first_messages) : first_messages;
  return send_other({.topic = broker.will.topic,
                     .payload = status_online(greeting, means_.version),
                     .is_retained = true});
}

void MqttSink::forget_flight() {
  flight_.clear();
  others_.clear();
  states_.clear();
}

bool MqttSink::wants(const Parcel& parcel) const {
  if (parcel.gap() != nullptr) return true;
  if (parcel.event() == nullptr) return false;
  return parcel.is_result || means_.settings.events == files::SinkEvents::all;
}

std::string MqttSink::topic_of(const Parcel& parcel) const {
  const std::string_view what = parcel.gap() != nullptr ? "gap"
                                : parcel.is_result      ? "result"
                                                        : "event";
  return topics_[broker_].of_tool(parcel.target, what);
}

/// How much may be on its way at once; the library would keep the rest without a bound.
std::size_t MqttSink::limit() const {
  return careful_ > 0 ? 1 : std::min(window(), client_->receive_maximum());
}

Result<void> MqttSink::send(std::span<const Parcel> parcels) {
  while (flight_.size() < parcels.size() && flight_.size() + others_.size() < limit()) {
    const Parcel& parcel = parcels[flight_.size()];
    if (flight_.empty()) answered_at_ = means_.clock.now();
    TRY_LET(const auto message,
            client_->publish(
                {.topic = topic_of(parcel), .payload = parcel.json, .key = key_of(parcel)}));
    flight_.push_back({.message = message});
  }
  return {};
}

Result<std::size_t> MqttSink::deliver(std::span<const Parcel> parcels, Duration patience) {
  const TimePoint deadline = means_.clock.now() + patience;
  while (true) {
    if (careful_ == 0) {
      TRY(send_states());
    }
    TRY(send(parcels));
    const Duration left = std::max(deadline - means_.clock.now(), Duration::zero());
    TRY(client_->turn(left));
    TRY(take_answers(parcels));
    const std::size_t acknowledged = take_acknowledged();
    if (acknowledged > 0) return acknowledged;
    if (!flight_.empty() && means_.clock.now() - answered_at_ > answer_limit) {
      return tl::unexpected(Error{.code = Errc::no_answer,
                                  .message = "the broker acknowledges nothing any more",
                                  .hint = "see its log and its disk",
                                  .name = brokers_[broker_].url.text});
    }
    if (means_.clock.now() >= deadline || means_.interrupt.raised()) return 0;
  }
}

Result<void> MqttSink::take_answers(std::span<const Parcel> parcels) {
  for (const MqttAnswer& answer : client_->take_answers()) {
    answered_at_ = means_.clock.now();
    TRY(check_answer(answer, parcels));
  }
  return {};
}

Result<void> MqttSink::check_answer(const MqttAnswer& answer, std::span<const Parcel> parcels) {
  const bool is_refused = answer.reason >= first_refusal;
  if (!is_refused && careful_ > 0) --careful_;
  const auto sent = std::find_if(flight_.begin(), flight_.end(),
                                 [&](const Sent& each) { return each.message == answer.message; });
  if (sent != flight_.end()) {
    sent->is_acknowledged = !is_refused;
    if (!is_refused) return {};
    const auto index = static_cast<std::size_t>(sent - flight_.begin());
    const std::string topic = index < parcels.size() ? topic_of(parcels[index]) : std::string();
    return tl::unexpected(refused(topic, answer.reason));
  }
  const auto other = others_.find(answer.message);
  if (other == others_.end()) return {};
  // What is only so now need not arrive, but must not be missed in silence.
  if (is_refused && refused_.insert(other->second).second) {
    means_.note(describe(refused(other->second, answer.reason)));
  }
  others_.erase(other);
  return {};
}

Error MqttSink::refused(const std::string& topic, int reason) const {
  return {
      .code = Errc::exception_response,
      .message = fmt::format("the broker refuses topic '{}': {}", topic, reason_in_words(reason)),
      .hint = "nothing is lost: it is sent again until the broker takes it",
      .name = brokers_[broker_].url.text};
}

std::size_t MqttSink::take_acknowledged() {
  std::size_t acknowledged = 0;
  while (!flight_.empty() && flight_.front().is_acknowledged) {
    flight_.pop_front();
    ++acknowledged;
  }
  return acknowledged;
}

Result<void> MqttSink::tell_states(std::span<const ToolState> states) {
  for (const ToolState& state : states) states_[state.target] = state.json;
  return {};
}

/// Results go first: states take a part of the window.
Result<void> MqttSink::send_states() {
  const std::size_t most = std::max<std::size_t>(1, limit() / 4);
  while (!states_.empty() && others_.size() < most && flight_.size() + others_.size() < limit()) {
    const auto state = states_.extract(states_.begin());
    TRY(send_other({.topic = topics_[broker_].of_tool(state.key(), "state"),
                    .payload = state.mapped(),
                    .is_retained = true}));
  }
  return {};
}

Result<void> MqttSink::send_other(const MqttMessage& message) {
  if (refused_.contains(message.topic)) return {};
  TRY_LET(const auto number, client_->publish(message));
  others_[number] = message.topic;
  return {};
}

Result<void> MqttSink::idle(Duration time) {
  const TimePoint deadline = means_.clock.now() + time;
  do {
    TRY(client_->turn(std::max(deadline - means_.clock.now(), Duration::zero())));
    TRY(take_answers({}));
    TRY(send_states());
  } while (means_.clock.now() < deadline && !means_.interrupt.raised());
  return {};
}

/// The last will is what is said of a client that cannot say goodbye.
void MqttSink::close() {
  if (!client_) return;
  const TimePoint deadline = means_.clock.now() + farewell;
  MqttMessage goodbye = brokers_[broker_].will;
  const auto sent = client_->publish(goodbye);
  bool is_taken = !sent;
  while (!is_taken && means_.clock.now() < deadline) {
    if (!client_->turn(deadline - means_.clock.now(), MqttClient::Heeds::nothing)) break;
    for (const MqttAnswer& answer : client_->take_answers()) {
      is_taken = is_taken || answer.message == *sent;
    }
  }
  client_->disconnect(farewell);
  client_.reset();
  was_cut_ = !flight_.empty();
  forget_flight();
}

}  // namespace

Result<std::unique_ptr<Sink>> make_mqtt_sink(SinkMeans means) {
  std::vector<MqttClient::Settings> brokers;
  const files::Sink& settings = means.settings;
  for (const std::string& text : settings.urls) {
    TRY_LET(auto url, files::parse_sink_url(text));
    MqttClient::Settings& broker = brokers.emplace_back();
    broker.will = {.topic = Topics(url.base).of_collector(means.collector),
                   .payload = status_offline(),
                   .is_retained = true};
    broker.url = std::move(url);
    broker.client_id = client_id_of(settings, means.collector);
    broker.user = settings.user;
    broker.password = means.password;
    broker.ca_file = settings.ca_file;
    broker.cert_file = settings.cert_file;
    broker.key_file = settings.key_file;
    // What is wrong with files is known before anything is sent.
    TRY(MqttClient::make(broker, means.clock, means.interrupt));
  }
  return std::make_unique<MqttSink>(std::move(means), std::move(brokers));
}

}  // namespace spindle::forward
