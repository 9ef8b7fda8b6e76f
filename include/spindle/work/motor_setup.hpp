#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spindle/device/rollback.hpp"
#include "spindle/device/run_model.hpp"
#include "spindle/work/change.hpp"
#include "spindle/work/environment.hpp"
#include "spindle/work/run.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::work {

/// A parameter and what it is to be.
using Setting = std::pair<catalogue::Parameter, catalogue::Value>;

/// What every run of a motor decides before its driver is touched.
struct MotorPlan {
  RunOptions options;
  std::vector<Setting> settings = {};           ///< the speed first, where it has one
  std::optional<Decimal> speed = std::nullopt;  ///< empty: the driver's own
  std::string speed_unit = {};                  ///< as people read it: "r/min"

  /// "500 r/min"; empty where the driver decides.
  [[nodiscard]] std::string speed_in_words() const;
};

/// What is typed behind an option for a parameter, with or without its unit. Errors name the
/// option.
Result<Setting> parse_setting(std::string_view option, const catalogue::Parameter& parameter,
                              std::string_view text);

/// Adds the speed that was typed, and remembers it.
Result<void> add_speed(const catalogue::Parameter& parameter, MotorPlan& plan);

/// "operation.2.speed=500 r/min, communication.timeout=1000 ms".
std::string settings_in_words(const std::vector<Setting>& settings);

/// What a driver is set to before its motor runs, how it is started, and what is set back
/// afterwards: one class for each run model.
class MotorSetup {
 public:
  /// All must outlive it. `monitor` may be null.
  MotorSetup(const device::MotorMonitor* monitor, OpenTool& tool, const Environment& environment,
             ChangeLog& log)
      : monitor_(monitor),
        tool_(&tool),
        environment_(&environment),
        changer_(tool.device, log, tool.target),
        uninterruptible_line_(tool, environment) {}
  MotorSetup(const MotorSetup&) = delete;
  MotorSetup& operator=(const MotorSetup&) = delete;
  virtual ~MotorSetup() = default;

  /// Reads what the run depends on, and checks that the motor may be started. Only reads.
  virtual Result<void> look() = 0;
  /// What other drivers on the line have to do with the run, as a sentence; may be empty. Only
  /// reads.
  virtual Result<std::string> group_in_words() { return std::string(); }
  /// Looks, and then writes the settings. The motor does not turn.
  virtual Result<void> prepare() = 0;

  // ---- these require that prepare() succeeded ----

  /// The number that starts the run.
  [[nodiscard]] virtual std::uint32_t start_number() const = 0;
  virtual Result<void> start(device::Device& device) const = 0;
  /// Knows how the motor was started.
  [[nodiscard]] virtual std::unique_ptr<device::Stopper> stopper(
      catalogue::StopMode mode) const = 0;
  /// How long the motor may take to stand still.
  [[nodiscard]] virtual Duration stopping() const = 0;
  /// How often it has to be asked at least.
  [[nodiscard]] virtual Duration interval(Duration usual) const { return usual; }

  /// What the user should know of the run, as a sentence; may be empty.
  [[nodiscard]] virtual std::string advice() const { return {}; }
  /// What to look at where a motor did not start, or ran too fast.
  [[nodiscard]] virtual std::string hint_not_started() const = 0;
  [[nodiscard]] virtual std::string hint_too_fast() const { return {}; }

  /// Of a motor that stands still, also after prepare() failed: sets back what was written. Not
  /// ended by an interrupt, and reopens a lost link. Returns what could not be set back.
  std::vector<Left> put_back();
  /// What was written and not set back, of a motor that may still run.
  [[nodiscard]] std::vector<Left> left() const;

 protected:
  [[nodiscard]] OpenTool& tool() const { return *tool_; }
  [[nodiscard]] const Environment& environment() const { return *environment_; }
  [[nodiscard]] Changer& changer() { return changer_; }
  /// Error `negative` where an alarm is present, or the motor runs or its driver works.
  Result<void> check_at_rest();
  /// Reads what a parameter is, and writes it where it is something else.
  Result<void> write_one(const catalogue::Parameter& parameter, const catalogue::Value& value);
  /// Settings are written in this way where a driver needs another one.
  [[nodiscard]] virtual catalogue::Parameter written_as(const catalogue::Parameter& parameter,
                                                        const catalogue::Value& before,
                                                        const catalogue::Value& value) const;
  /// Before settings are set back.
  virtual void begin_put_back() {}
  /// What else is not as it was found.
  virtual void add_left(std::vector<Left>& left) const { static_cast<void>(left); }
  /// What a setting does that is not set back; may be empty.
  [[nodiscard]] virtual std::string left_note(const catalogue::Parameter& parameter) const;

 private:
  [[nodiscard]] Left left_of(const device::JournalEntry& write, std::string trouble) const;

  const device::MotorMonitor* monitor_;
  OpenTool* tool_;
  const Environment* environment_;
  Changer changer_;
  UninterruptibleLine uninterruptible_line_;
};

}  // namespace spindle::work
