#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "spindle/catalogue/profile.hpp"
#include "spindle/chart/curves.hpp"
#include "spindle/report/record.hpp"
#include "spindle/store/rows.hpp"

namespace spindle::commands {

/// The curves of one stored event, as they were told.
struct StoredCurve {
  struct Channel {
    std::string type = {};  ///< empty: not known
    catalogue::CurveQuantity is = catalogue::CurveQuantity::other;
    std::string unit = {};
    std::vector<float> samples = {};
  };
  struct Step {
    std::string name = {};
    std::size_t sample = 0;
  };
  report::Record header = {};  ///< the record `curve` without its samples
  std::vector<Channel> channels = {};
  std::vector<Step> steps = {};
  double sampling_ms = 0;  ///< 0: not known
};

/// Empty: what is stored cannot be understood.
std::optional<StoredCurve> stored_curve(const store::Curve& row);

/// The record `curve` with its samples.
report::Record curve_record(const StoredCurve& curve);

/// What runs to the right.
enum class CurveAxis : std::uint8_t { angle, time };

/// The torque over the axis; without points where it has no torque, or the axis is not known.
chart::Curve drawn_curve(const StoredCurve& curve, CurveAxis axis, std::string name, bool is_ng);
/// Where its steps begin.
std::vector<chart::StepMark> drawn_steps(const StoredCurve& curve, CurveAxis axis);
/// What the axes are.
chart::Quantity quantity_along(const StoredCurve& curve, CurveAxis axis);
chart::Quantity torque_of(const StoredCurve& curve);

}  // namespace spindle::commands
