// SPDX-License-Identifier: MIT
#include "scenes/things.h"
