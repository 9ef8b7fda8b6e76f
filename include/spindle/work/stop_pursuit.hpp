#pragma once

#include <memory>
#include <optional>
#include <string>

#include "spindle/device/run_model.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/environment.hpp"

namespace spindle::work {

/// A stop of one tool that this program did not start, or of which it knows nothing any more. It is
/// pursued as a guard does it: for about ten seconds, over lost answers and lost connections, and
/// signals do not end it.
class StopPursuit {
 public:
  /// What the tool is comes from its profile, or where none is named from its identity.
  /// `environment` is one that signals do not end; its references must outlive it.
  StopPursuit(const Target& target, catalogue::StopMode mode, const Environment& environment);
  /// Of a tool that is known, and to which a start may still be under way. Its connection is not
  /// used.
  StopPursuit(const OpenTool& tool, catalogue::StopMode mode, const Environment& environment);
  StopPursuit(const StopPursuit&) = delete;
  StopPursuit& operator=(const StopPursuit&) = delete;
  ~StopPursuit() = default;

  /// All tries, with their pauses.
  device::StopReport stop() { return guard_.stop(); }
  /// One try; true when it was the last one. The next one comes RunGuard::pause later.
  bool try_stop() { return guard_.try_stop().has_value(); }

  /// How it ended; an error where the last try did not reach the tool, or no further try would
  /// help.
  [[nodiscard]] Result<device::StopResult> result();

  /// Null where it never became known.
  [[nodiscard]] const catalogue::Profile* profile() const { return profile_; }

  /// The serial number that the tool said before it was stopped; empty: it was not known in time.
  [[nodiscard]] const std::string& serial() const { return serial_; }

 private:
  device::GuardedMotion motion();
  Result<device::Device> open(Duration patience);
  Result<device::Device> connect();
  Result<device::Device> connect_unknown();
  Result<void> adopt(std::unique_ptr<const catalogue::Profile> profile);
  Result<void> prepare_stop();
  Result<void> check_generation(device::Device& device);
  Result<device::StopResult> stop(device::Device& device, Clock& clock);
  Result<device::StopResult> send_stop(device::Device& device, Clock& clock);

  Target target_;
  catalogue::StopMode mode_;
  std::optional<Duration> wanted_connect_;  ///< what the user said of the time to connect
  Duration usual_;                          ///< time to connect
  Environment environment_;                 ///< lines that are opened on it refer to it
  std::unique_ptr<const catalogue::Profile> own_profile_ = nullptr;
  const catalogue::Profile* profile_ = nullptr;  ///< null: not known yet
  std::unique_ptr<const device::RunModel> model_ = nullptr;
  std::unique_ptr<device::Stopper> stopper_ = nullptr;
  bool was_observed_ = false;
  bool generation_is_checked_ = false;
  std::string serial_ = {};
  unsigned questions_ = 0;
  std::optional<Error> last_ = std::nullopt;
  device::RunGuard guard_;  ///< its device needs the profile
};

}  // namespace spindle::work
