// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

namespace topoloc::live {

/// The calling thread and those it creates from now on leave a CPU to others, unless it is the only
/// one they have.
void keep_off_cpu(int cpu);

}  // namespace topoloc::live
