#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "spindle/base/bytes.hpp"

namespace spindle::sim {

/// One event of a screwdriver with firmware 4000 or later. It has the same 107 registers in
/// whatever frame it comes (HTool EventFrame.cs, Analysis.cs).
struct Gen2Event {
  /// All 0: the tool has none.
  struct Date {
    std::uint16_t year = 0;
    std::uint8_t month = 0;
    std::uint8_t day = 0;
    std::uint8_t hour = 0;
    std::uint8_t minute = 0;
    std::uint8_t second = 0;
    std::uint8_t fraction = 0;  ///< what it counts is not known
  };
  struct Curve {
    std::uint16_t type = 0;
    std::uint16_t samples = 0;
  };
  struct Step {
    std::uint16_t type = 0;
    std::uint16_t start = 0;  ///< index of its first sample
  };

  std::uint16_t number = 0;
  Date date = {};
  std::uint16_t fastening_time = 0;
  std::uint16_t preset = 0;
  std::uint16_t torque_unit = 0;
  std::uint16_t screws_remaining = 0;
  std::uint16_t direction = 0;
  std::uint16_t error = 0;
  std::uint16_t status = 0;
  float target_torque = 0;
  float torque = 0;
  float seating_torque = 0;
  float clamp_torque = 0;
  float prevailing_torque = 0;
  float snug_torque = 0;
  std::uint16_t speed = 0;
  std::uint16_t a1 = 0;
  std::uint16_t a2 = 0;
  std::uint16_t a3 = 0;
  std::uint16_t snug_angle = 0;
  std::uint16_t sync_id = 0;
  std::string barcode = {};  ///< as far as it has 64 characters
  std::array<Curve, 2> curves = {};
  std::uint16_t sampling = 0;  ///< ms
  std::array<Step, 16> steps = {};
};

/// Its 107 registers.
Registers block_of(const Gen2Event& event);

}  // namespace spindle::sim
