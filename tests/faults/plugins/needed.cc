// SPDX-License-Identifier: Apache-2.0
// A library that a plugin needs, and with DEEP one that this needs.
#if defined(DEEP)
extern "C" int deep() { return 2; }
#else
extern "C" int deep();
extern "C" int needed() { return deep(); }
#endif
