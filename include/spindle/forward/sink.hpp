#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/files/sink.hpp"
#include "spindle/forward/parcel.hpp"

namespace spindle::forward {

/// Who speaks, told to a sink at each connection.
struct Greeting {
  std::vector<std::string> targets = {};  ///< names of the tools in the store
  store::RowId first = 0;                 ///< oldest event that is not acknowledged yet
  store::RowId last = 0;                  ///< newest event in the store
};

/// What is so of a tool now, whatever waits to be delivered.
struct ToolState {
  std::string target = {};
  std::string json = {};  ///< one object on one line
};

/// What every sink is made with. All that is referred to outlives it.
struct SinkMeans {
  const files::Sink& settings;
  std::string collector = {};                          ///< never empty
  std::string version = {};                            ///< of spindle
  std::optional<std::string> password = std::nullopt;  ///< what the password file holds
  Clock& clock;
  const Interrupt& interrupt;
  std::function<void(const std::string& text)> note = {};  ///< tells the user; never empty
  /// Tells the user what went wrong with a parcel that counts as delivered; never empty.
  std::function<void(const Error& error)> fault = {};
  /// Looks within a few seconds, and a signal ends it, whether a server takes connections there.
  /// For libraries that look names up and connect without end. Never empty. Errors: name_not_found,
  /// connection_refused, no_route, connect_timeout, and those of signals.
  std::function<Result<void>(const std::string& host, std::uint16_t port)> reach = {};
};

/// One place that gets what is in the store. Nothing is kept by a sink over its own end: what it
/// did not acknowledge is handed to it again. An error of any function means that the connection is
/// not usable any more: the next call is connect() (after a pause) or close(). Errors name what
/// went wrong in words, never a password; `unreachable` kinds (connection_refused, name_not_found,
/// no_route, connect_timeout) and no_answer, closed, reset for a network that is not well;
/// `refused`, `bad_value`, `bad_file` and so on where the other side does not want it. One thread.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;

  /// Tries all its URLs once, in turn, from the one that worked last. Whatever was in flight before
  /// is forgotten. May take some seconds; ends early with `Errc::interrupted` or `terminated`.
  virtual Result<void> connect(const Greeting& greeting) = 0;

  /// Whether this sink is to get it at all. What is not wanted counts as delivered.
  [[nodiscard]] virtual bool wants(const Parcel& parcel) const = 0;

  /// With how many parcels deliver() is called at most.
  [[nodiscard]] virtual std::size_t window() const = 0;

  /// Hands on parcels, in their order: at the front stand those of the call before that were not
  /// acknowledged (unless connect() was called since), behind them may be new ones. Returns how
  /// many of the front the other side has for good; 0 where it has none yet. Waits for an
  /// acknowledgement as long as is usual for the other side, but not much longer than `patience`.
  /// Never called with none.
  virtual Result<std::size_t> deliver(std::span<const Parcel> parcels, Duration patience) = 0;

  /// Tells what is so now of tools of which it changed; of all after a connection. Only of sinks
  /// that tell states.
  virtual Result<void> tell_states(std::span<const ToolState> /*states*/) { return {}; }
  [[nodiscard]] virtual bool tells_states() const { return false; }

  /// Where a parcel goes, for people: a topic, a table.
  [[nodiscard]] virtual std::string place_of(const Parcel& /*parcel*/) const { return {}; }

  /// There is nothing to deliver: waits so long, keeps the connection alive, and says when it
  /// ended. Ends early, without an error, when a signal asks the program to end.
  virtual Result<void> idle(Duration time) = 0;

  /// Says goodbye as the other side expects it; within a few seconds, also after a signal. Never
  /// fails.
  virtual void close() = 0;
};

/// The sink for MQTT 5: mqtt:// and mqtts://. Connects later. Errors: what is wrong in its settings
/// or unreadable of its files, all before anything is sent.
Result<std::unique_ptr<Sink>> make_mqtt_sink(SinkMeans means);

/// The sink for PostgreSQL: postgresql:// and postgres://. Likewise.
Result<std::unique_ptr<Sink>> make_postgres_sink(SinkMeans means);

}  // namespace spindle::forward
