#pragma once

#include <cstdint>

#include "spindle/base/clock.hpp"
#include "spindle/catalogue/identity.hpp"
#include "spindle/catalogue/list.hpp"
#include "spindle/catalogue/text.hpp"

namespace spindle::catalogue {

/// How tools are found on a network: a datagram to a multicast group, and what they answer. A
/// datagram begins with the number of the question and a type, 16 bits each, high byte first;
/// slices count from 0 behind these. One that is empty is not told.
struct DiscoverySpec {
  Text group = {};           ///< IPv4 address
  std::uint16_t port = 0;    ///< UDP port of the group
  std::uint16_t ask = 0;     ///< type of the question, which has nothing behind it
  std::uint16_t answer = 0;  ///< type of the answer
  std::uint8_t bytes = 0;    ///< of an answer, behind the type; another length is none
  Duration every = std::chrono::seconds(3);  ///< between two questions
  Slice serial = {};                         ///< text, ended by a zero
  Slice model = {};                          ///< number
  Slice address = {};                        ///< IPv4 address of the tool
  Slice tool_port = {};                      ///< its TCP port
  Slice mac = {};
  Slice firmware = {};
  Slice in_use = {};            ///< 0: no client has it
  Slice kind = {};              ///< number of the product
  Table<unsigned, Text> kinds;  ///< its name
};

}  // namespace spindle::catalogue
