// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Includes the public headers for estimation: problems, filters, rollback and the RTS smoother.
#include "alidade/base/timestamp.h"
#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/problem.h"
#include "alidade/estimation/rollback.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
