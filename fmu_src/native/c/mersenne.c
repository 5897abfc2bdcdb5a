/* Uniform numbers as Python's random.Random(seed) draws them: MT19937 of Matsumoto and Nishimura.
 *
 * M. Matsumoto and T. Nishimura, Mersenne Twister: a 623-dimensionally equidistributed uniform pseudo-random number
 * generator, ACM Transactions on Modeling and Computer Simulation 8 (1998); their initialisation by an array, 2002.
 */
#include "model.h"

enum { N = 624, M = 397 };

typedef struct {
    uint32_t state[N];
    int next;
} Twister;

static void seed_one(Twister *t, uint32_t seed)
{
    t->state[0] = seed;
    for (uint32_t i = 1; i < N; i++)
        t->state[i] = 1812433253u * (t->state[i - 1] ^ (t->state[i - 1] >> 30)) + i;
    t->next = N;
}

/* The index after ``i``; at the end the first element becomes a copy of the last one. */
static int after(uint32_t *state, int i)
{
    if (i < N - 1)
        return i + 1;
    state[0] = state[N - 1];
    return 1;
}

/* A seed below 2^32 is an array of one element. */
static void seed_array(Twister *t, uint32_t key)
{
    uint32_t *x = t->state;
    int i = 1;
    seed_one(t, 19650218u);
    for (int k = N; k > 0; k--, i = after(x, i))
        x[i] = (x[i] ^ ((x[i - 1] ^ (x[i - 1] >> 30)) * 1664525u)) + key;
    for (int k = N - 1; k > 0; k--, i = after(x, i))
        x[i] = (x[i] ^ ((x[i - 1] ^ (x[i - 1] >> 30)) * 1566083941u)) - (uint32_t)i;
    x[0] = 0x80000000u;
}

static uint32_t draw(Twister *t)
{
    if (t->next == N) {
        for (int k = 0; k < N; k++) {
            const uint32_t y = (t->state[k] & 0x80000000u) | (t->state[(k + 1) % N] & 0x7fffffffu);
            t->state[k] = t->state[(k + M) % N] ^ (y >> 1) ^ (y & 1 ? 0x9908b0dfu : 0);
        }
        t->next = 0;
    }
    uint32_t y = t->state[t->next++];
    y ^= y >> 11;
    y ^= (y << 7) & 0x9d2c5680u;
    y ^= (y << 15) & 0xefc60000u;
    return y ^ (y >> 18);
}

List_f phases(Space *space, int64_t seed, int64_t count)
{
    const double full = 2.0 * 3.141592653589793;
    List_f drawn = new_List_f(space, count);
    Twister twister;
    seed_array(&twister, (uint32_t)seed);
    for (int64_t k = 0; k < count; k++) {
        const uint32_t a = draw(&twister) >> 5, b = draw(&twister) >> 6;
        drawn.at[drawn.count++] = 0.0 + (full - 0.0) * ((a * 67108864.0 + b) * (1.0 / 9007199254740992.0));
    }
    return drawn;
}
