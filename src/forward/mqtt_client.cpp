#include "mqtt_client.hpp"

#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "mqtt_words.hpp"

namespace spindle::forward {
namespace {

constexpr int keep_alive_s = 20;
constexpr int at_least_once = 1;
constexpr int first_refusal = 128;
/// Where OpenSSL of Debian keeps whom the system trusts.
constexpr const char* trusted_by_system = "/etc/ssl/certs";

/// Properties of MQTT 5, freed with this.
class Properties {
 public:
  Properties() = default;
  Properties(const Properties&) = delete;
  Properties& operator=(const Properties&) = delete;
  ~Properties() { mosquitto_property_free_all(&list_); }

  void add(int identifier, const char* value) {
    mosquitto_property_add_string(&list_, identifier, value);
  }
  void add(int identifier, const char* name, const char* value) {
    mosquitto_property_add_string_pair(&list_, identifier, name, value);
  }
  [[nodiscard]] const mosquitto_property* get() const { return list_; }
  /// For who frees it.
  mosquitto_property* release() { return std::exchange(list_, nullptr); }

 private:
  mosquitto_property* list_ = nullptr;
};

constexpr const char* content_type = "application/json";

/// A key with a passphrase is never asked for at a terminal.
int no_passphrase(char* /*buffer*/, int /*size*/, int /*is_written*/, void* /*user*/) { return 0; }

int milliseconds(Duration time) {
  return static_cast<int>(
      std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::milliseconds>(time).count()));
}

const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

/// "error:0A000086:SSL routines::certificate verify failed" without what only programmers read.
std::string plain_complaint(std::string_view line) {
  if (line.starts_with("Error: ")) line.remove_prefix(std::string_view("Error: ").size());
  if (line.starts_with("OpenSSL Error")) {
    const std::size_t colon = line.rfind(':');
    return "TLS: " + std::string(line.substr(colon + 1));
  }
  while (line.ends_with('.')) line.remove_suffix(1);
  return std::string(line);
}

}  // namespace

MqttClient::Library::Library() { mosquitto_lib_init(); }
MqttClient::Library::~Library() { mosquitto_lib_cleanup(); }

void MqttClient::Destroyer::operator()(mosquitto* handle) const { mosquitto_destroy(handle); }

struct MqttClient::Events {
  static MqttClient& client(void* self) { return *static_cast<MqttClient*>(self); }

  static void on_connect(mosquitto*, void* self, int reason, int, const mosquitto_property* list) {
    MqttClient& client = Events::client(self);
    client.accepted_ = reason;
    std::uint16_t maximum = 0;
    if (mosquitto_property_read_int16(list, MQTT_PROP_RECEIVE_MAXIMUM, &maximum, false) !=
        nullptr) {
      client.receive_maximum_ = std::max<std::size_t>(maximum, 1);
    }
    std::uint8_t qos = at_least_once;
    mosquitto_property_read_byte(list, MQTT_PROP_MAXIMUM_QOS, &qos, false);
    client.takes_qos_ = qos >= at_least_once;
  }

  static void on_disconnect(mosquitto*, void* self, int reason, const mosquitto_property*) {
    client(self).lost_ = reason;
  }

  static void on_publish(mosquitto*, void* self, int message, int reason,
                         const mosquitto_property*) {
    client(self).answers_.push_back({.message = message, .reason = reason});
  }

  static void on_log(mosquitto*, void* self, int level, const char* text) {
    // What follows it is less to the point.
    if (level == MOSQ_LOG_ERR && client(self).complaint_.empty()) client(self).complaint_ = text;
  }
};

MqttClient::MqttClient(const Settings& settings, const Clock& clock, const Interrupt& interrupt)
    : clock_(&clock),
      interrupt_(&interrupt),
      url_(settings.url),
      handle_(mosquitto_new(settings.client_id.c_str(), true, this)) {}

Result<std::unique_ptr<MqttClient>> MqttClient::make(const Settings& settings, const Clock& clock,
                                                     const Interrupt& interrupt) {
  struct Made final : MqttClient {
    Made(const Settings& of, const Clock& time, const Interrupt& signals)
        : MqttClient(of, time, signals) {}
  };
  std::unique_ptr<MqttClient> client = std::make_unique<Made>(settings, clock, interrupt);
  TRY(client->prepare(settings));
  return client;
}

Result<void> MqttClient::prepare(const Settings& settings) {
  if (!handle_) {
    return tl::unexpected(error(Errc::bad_value, "the client identifier cannot be used"));
  }
  mosquitto* const handle = handle_.get();
  mosquitto_int_option(handle, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  mosquitto_int_option(handle, MOSQ_OPT_TCP_NODELAY, 1);
  mosquitto_connect_v5_callback_set(handle, Events::on_connect);
  mosquitto_disconnect_v5_callback_set(handle, Events::on_disconnect);
  mosquitto_publish_v5_callback_set(handle, Events::on_publish);
  mosquitto_log_callback_set(handle, Events::on_log);
  if (!settings.user.empty() || settings.password) {
    const char* password = settings.password ? settings.password->c_str() : nullptr;
    TRY(judge(mosquitto_username_pw_set(handle, settings.user.c_str(), password)));
  }
  Properties properties;
  properties.add(MQTT_PROP_CONTENT_TYPE, content_type);
  const MqttMessage& will = settings.will;
  TRY(judge(mosquitto_will_set_v5(handle, will.topic.c_str(), static_cast<int>(will.payload.size()),
                                  will.payload.data(), at_least_once, will.is_retained,
                                  properties.release())));
  if (!settings.url.is_encrypted) return {};
  return prepare_tls(settings);
}

/// The name of the host is compared with the certificate's unless a client forbids it.
Result<void> MqttClient::prepare_tls(const Settings& settings) {
  mosquitto* const handle = handle_.get();
  const bool has_own = !settings.ca_file.empty();
  constexpr int verify_peer = 1;
  TRY(judge(mosquitto_tls_set(handle, or_null(settings.ca_file),
                              has_own ? nullptr : trusted_by_system, or_null(settings.cert_file),
                              or_null(settings.key_file), no_passphrase)));
  return judge(mosquitto_tls_opts_set(handle, verify_peer, "tlsv1.2", nullptr));
}

Result<void> MqttClient::connect(Duration patience) {
  accepted_.reset();
  lost_.reset();
  complaint_.clear();
  answers_.clear();
  const TimePoint deadline = clock_->now() + patience;
  TRY(judge(mosquitto_connect_bind_v5(handle_.get(), url_.host.c_str(), url_.port, keep_alive_s,
                                      nullptr, nullptr)));
  while (!accepted_) {
    const Duration left = deadline - clock_->now();
    if (left <= Duration::zero()) {
      return tl::unexpected(error(Errc::no_answer, "the broker does not answer"));
    }
    auto turned = turn(left);
    if (!turned && !accepted_) return turned;
    if (interrupt_->raised()) return tl::unexpected(interrupt_->error());
  }
  if (*accepted_ != 0) {
    return tl::unexpected(error(Errc::exception_response, "the broker refuses the connection: " +
                                                              reason_in_words(*accepted_)));
  }
  if (takes_qos_) return {};
  return tl::unexpected(
      error(Errc::exception_response, "the broker acknowledges no messages (maximum QoS 0)"));
}

Result<int> MqttClient::publish(const MqttMessage& message) {
  Properties properties;
  properties.add(MQTT_PROP_CONTENT_TYPE, content_type);
  if (!message.key.empty()) {
    properties.add(MQTT_PROP_USER_PROPERTY, "key", message.key.c_str());
  }
  int number = 0;
  auto sent = judge(mosquitto_publish_v5(
      handle_.get(), &number, message.topic.c_str(), static_cast<int>(message.payload.size()),
      message.payload.data(), at_least_once, message.is_retained, properties.get()));
  if (!sent) return tl::unexpected(std::move(sent.error()));
  return number;
}

Result<void> MqttClient::turn(Duration patience, Heeds heeds) {
  if (lost_) return tl::unexpected(lost(*lost_));
  TRY(wait_for_network(patience, heeds));
  TRY(judge(mosquitto_loop_misc(handle_.get())));
  if (lost_) return tl::unexpected(lost(*lost_));
  return {};
}

Result<void> MqttClient::wait_for_network(Duration patience, Heeds heeds) {
  mosquitto* const handle = handle_.get();
  const int socket = mosquitto_socket(handle);
  if (socket < 0) return tl::unexpected(lost(MOSQ_ERR_CONN_LOST));
  const bool writes = mosquitto_want_write(handle);
  std::array<pollfd, 2> waits = {{{.fd = socket,
                                   .events = static_cast<short>(writes ? POLLIN | POLLOUT : POLLIN),
                                   .revents = 0},
                                  {.fd = heeds == Heeds::interrupt ? interrupt_->descriptor() : -1,
                                   .events = POLLIN,
                                   .revents = 0}}};
  const int ready = ::poll(waits.data(), waits.size(), milliseconds(patience));
  if (ready <= 0) return {};  // a signal is seen by who asked for this
  constexpr int packets = 100;
  if ((waits[0].revents & (POLLIN | POLLERR | POLLHUP)) != 0) {
    TRY(judge(mosquitto_loop_read(handle, packets)));
  }
  if ((waits[0].revents & POLLOUT) != 0 && !lost_) {
    TRY(judge(mosquitto_loop_write(handle, packets)));
  }
  return {};
}

std::vector<MqttAnswer> MqttClient::take_answers() { return std::exchange(answers_, {}); }

void MqttClient::disconnect(Duration patience) {
  if (lost_) return;
  if (mosquitto_disconnect_v5(handle_.get(), MQTT_RC_NORMAL_DISCONNECTION, nullptr) !=
      MOSQ_ERR_SUCCESS) {
    return;
  }
  const TimePoint deadline = clock_->now() + patience;
  while (!lost_ && mosquitto_want_write(handle_.get()) && clock_->now() < deadline) {
    if (!turn(deadline - clock_->now(), Heeds::nothing)) return;
  }
}

Result<void> MqttClient::judge(int answer) {
  if (answer == MOSQ_ERR_SUCCESS) return {};
  return tl::unexpected(lost_ ? lost(*lost_) : failed(answer));
}

/// What the broker said, or what became of the connection.
Error MqttClient::lost(int reason) const {
  if (reason >= first_refusal) {
    return error(Errc::closed, "the broker ended the connection: " + reason_in_words(reason));
  }
  return failed(reason == MOSQ_ERR_SUCCESS ? MOSQ_ERR_CONN_LOST : reason);
}

Error MqttClient::failed(int answer) const {
  const bool was_accepted = accepted_ == 0;
  const std::string complaint = complaint_.empty() ? "" : plain_complaint(complaint_);
  switch (answer) {
    case MOSQ_ERR_ERRNO:
      if (url_.is_encrypted && !was_accepted) break;
      return error(Errc::closed, std::generic_category().message(errno));
    case MOSQ_ERR_EAI:
    case MOSQ_ERR_LOOKUP:
      return error(Errc::name_not_found, "the name of the broker is not known");
    case MOSQ_ERR_OVERSIZE_PACKET:
      return error(Errc::exception_response,
                   "the message is larger than the broker takes (maximum packet size)",
                   "raise max_packet_size of the broker");
    case MOSQ_ERR_CONN_REFUSED:
      return error(Errc::exception_response, "the broker refuses the connection");
    case MOSQ_ERR_KEEPALIVE:
      return error(Errc::no_answer, "the broker does not answer any more");
    default:
      break;
  }
  if (url_.is_encrypted && !was_accepted && !complaint.empty()) {
    return error(Errc::connection_refused, complaint,
                 "compare ca-file, the host's name and the client's certificate with the broker's");
  }
  const bool is_lost =
      answer == MOSQ_ERR_CONN_LOST || answer == MOSQ_ERR_NO_CONN || answer == MOSQ_ERR_ERRNO;
  if (!is_lost) return error(Errc::malformed_answer, mosquitto_strerror(answer));
  if (was_accepted) return error(Errc::closed, "the broker ended the connection");
  return error(Errc::closed, "the broker ended the connection before it accepted the client",
               url_.is_encrypted ? "does it ask for a client's certificate (cert-file, key-file)?"
                                 : "does it ask for TLS (mqtts), and does it know MQTT 5?");
}

Error MqttClient::error(Errc code, std::string message, std::string hint) const {
  if (hint.empty()) hint = "what is stored stays until the broker has it";
  return {.code = code,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = fmt::format("{}:{}", url_.host, url_.port)};
}

}  // namespace spindle::forward
