#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/event_layout.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::catalogue {

/// The samples of one channel as they came: four bytes each, binary32, the high byte first.
struct ChannelSamples {
  std::size_t channel = 0;  ///< from 0
  Bytes samples = {};
};

/// What a frame that was sent unasked holds.
struct PushedFrame {
  std::optional<Registers> block = std::nullopt;  ///< of an event
  std::vector<ChannelSamples> channels = {};
};

/// Reads the frames that a product sends unasked. Pure; nothing of a frame is believed before all
/// of its lengths and counts fit each other.
class EventFrames {
 public:
  /// Requires a profile with events, which must outlive it.
  explicit EventFrames(const Profile& profile);

  /// Error: why it is no such frame, as part of a sentence.
  [[nodiscard]] tl::expected<PushedFrame, std::string> decode(const modbus::Pdu& pdu) const;

  /// Whether a frame of this function tells of an event.
  [[nodiscard]] bool holds_event(std::uint8_t function) const;

  /// How many samples of each channel belong to an event; none where the product has no curves.
  [[nodiscard]] std::vector<std::size_t> counts_of(RegisterView block) const;

 private:
  using Decoded = tl::expected<PushedFrame, std::string>;
  [[nodiscard]] Decoded decode_event(ByteView data) const;
  [[nodiscard]] Decoded decode_event_with_curves(ByteView data) const;
  [[nodiscard]] Decoded decode_curve(ByteView data) const;

  const EventSpec* facts_;
  std::vector<std::size_t> count_at_ = {};  ///< register of the block, by channel
};

/// The samples as numbers. What is behind the last whole one is left out.
std::vector<float> to_samples(ByteView bytes);

/// A sample as the shortest decimal that is read back as the same; empty: it is no number.
std::optional<Decimal> to_decimal(float sample);

/// One channel, as its event says it.
struct ChannelFacts {
  std::uint16_t type = 0;
  std::string name = {};  ///< empty: the profile has no word for it
  CurveQuantity is = CurveQuantity::other;
  std::string unit = {};  ///< empty: none, or not known
  std::size_t count = 0;
};

/// Where a step of the rundown begins.
struct StepMarker {
  std::uint16_t type = 0;
  std::string name = {};  ///< its number where the profile has no word for it
  std::uint16_t sample = 0;
};

/// What an event says of its curves.
struct CurveFacts {
  std::vector<ChannelFacts> channels = {};  ///< the first one is channel 1
  std::uint16_t sampling_ms = 0;            ///< from one sample to the next; 0: not said
  std::vector<StepMarker> steps = {};
};

/// Requires a profile with curves, and a block of its size. Channels of torque have the unit
/// that the block says, else `unit_of_tool`.
CurveFacts curve_facts(const Profile& profile, const EventLayout& layout, RegisterView block,
                       std::string_view unit_of_tool);

}  // namespace spindle::catalogue
