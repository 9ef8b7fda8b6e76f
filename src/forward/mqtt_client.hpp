#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/files/sink.hpp"

struct mosquitto;

namespace spindle::forward {

struct MqttMessage {
  std::string topic = {};
  std::string payload = {};  ///< JSON
  bool is_retained = false;
  std::string key = {};  ///< user property of this name; empty: none
};

/// An acknowledgement of one message.
struct MqttAnswer {
  int message = 0;  ///< as publish() numbered it
  int reason = 0;   ///< from 128 on: it was refused
};

/// One connection to a broker: MQTT 5, clean start, QoS 1. Sends what it is told and nothing again;
/// subscribes to nothing. Errors name the broker and what is wrong in words, and no password.
/// One thread.
class MqttClient {
 public:
  struct Settings {
    files::SinkUrl url = {};
    std::string client_id = {};
    std::string user = {};
    std::optional<std::string> password = std::nullopt;
    std::string ca_file = {};  ///< empty: those that the system trusts
    std::string cert_file = {};
    std::string key_file = {};
    MqttMessage will = {};
  };

  /// Errors: what cannot be used of the settings.
  static Result<std::unique_ptr<MqttClient>> make(const Settings& settings, const Clock& clock,
                                                  const Interrupt& interrupt);

  /// To a broker of which it is known that it takes connections; until it has accepted this client.
  Result<void> connect(Duration patience);

  /// Hands a message over to the network, which turn() lets go on; returns its number.
  Result<int> publish(const MqttMessage& message);

  /// Whether an interrupt ends a wait.
  enum class Heeds : std::uint8_t { interrupt, nothing };

  /// Lets the network go on: waits until something comes, at most so long. Fails where the
  /// connection is lost.
  Result<void> turn(Duration patience, Heeds heeds = Heeds::interrupt);

  /// What was acknowledged since this was last asked.
  std::vector<MqttAnswer> take_answers();

  /// How many messages the broker allows to be without an acknowledgement.
  [[nodiscard]] std::size_t receive_maximum() const { return receive_maximum_; }

  /// Ends the connection as a client does that wants no last will; waits at most so long.
  void disconnect(Duration patience);

 private:
  struct Library {
    Library();
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;
    ~Library();
  };
  struct Destroyer {
    void operator()(mosquitto* handle) const;
  };
  struct Events;  ///< what the library calls

  MqttClient(const Settings& settings, const Clock& clock, const Interrupt& interrupt);

  Result<void> prepare(const Settings& settings);
  Result<void> prepare_tls(const Settings& settings);
  Result<void> wait_for_network(Duration patience, Heeds heeds);
  Result<void> judge(int answer);
  Error lost(int reason) const;
  Error failed(int answer) const;
  Error error(Errc code, std::string message, std::string hint = {}) const;

  Library library_ = {};
  const Clock* clock_;
  const Interrupt* interrupt_;
  files::SinkUrl url_;
  std::unique_ptr<mosquitto, Destroyer> handle_;
  std::optional<int> accepted_ = std::nullopt;  ///< the reason of the broker's answer
  std::optional<int> lost_ = std::nullopt;      ///< why there is no connection any more
  std::size_t receive_maximum_ = 65'535;
  bool takes_qos_ = true;
  std::vector<MqttAnswer> answers_ = {};
  std::string complaint_ = {};  ///< the library's first one of this connection
};

}  // namespace spindle::forward
