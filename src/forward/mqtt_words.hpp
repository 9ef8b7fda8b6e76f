#pragma once

#include <string>

namespace spindle::forward {

/// A reason code of MQTT 5 in words, with its number: "not authorized (135)" (MQTT 5.0, section
/// 2.4).
std::string reason_in_words(int code);

}  // namespace spindle::forward
