/* The contact kernel of ddagr_gym/physics/contact_patch.py in C: the same formulas in the same loops.

   benchmarks/speed.py builds it twice, to show what compiled Python costs against a C compiler: with the functions of
   libm (which gcc takes from its vector library), and, with -DPOLYNOMIALS, with those of ddagr_gym/physics/fast_math.py. */

#include <math.h>
#include <string.h>

enum { LANES = 8, WRENCH = 5 };

#define LANE _Pragma("omp simd") for (int i = 0; i < LANES; i++)

static inline double largest(double a, double b) { return a > b ? a : b; }
static inline double smallest(double a, double b) { return a < b ? a : b; }

#ifdef POLYNOMIALS

typedef long long integer;

static inline integer bits(double x) { integer n; memcpy(&n, &x, sizeof n); return n; }
static inline double from_bits(integer n) { double x; memcpy(&x, &n, sizeof x); return x; }

static inline double power_of_two(double x)
{
    x = largest(x, -1000.0);
    const double k = floor(x + 0.5), r = x - k;
    double p = 0.0013333558179047028
        + r * (0.00015403455846485034
        + r * (1.525268684250813e-05 + r * (1.3255226470378598e-06 + r * 1.0203122065960858e-07)));
    p = 1.0 + r * (0.6931471805599453
        + r * (0.24022650695812972 + r * (0.05550410866476042 + r * (0.009618129159408776 + r * p))));
    return from_bits(bits(p) + ((integer)k << 52));
}

static inline double logarithm_of_two(double x)
{
    const integer n = bits(x), exponent = (n - 0x3FE6A09E00000000) >> 52;
    const double mantissa = from_bits(n - exponent * ((integer)1 << 52));
    const double t = (mantissa - 1.0) / (mantissa + 1.0), q = t * t;
    const double p = 2.88539008177785 + q * (0.9617966941132127
        + q * (0.5770779423594591 + q * (0.412209256786155 + q * (0.3199053739227617 + q * 0.2829066165906811))));
    return (double)exponent + t * p;
}

static inline double inverse_sqrt(double x)
{
    double y = from_bits(0x5FE6E90000000000 - (bits(x) >> 1)), e = 1.0 - x * y * y;
    y += y * e * (0.5007268123083732 + e * 0.37561916254229494);
    e = 1.0 - x * y * y;
    return y + y * e * (0.5 + e * 0.375);
}

static inline double sine_of(double x)
{
    const double q = x * x;
    return x * (0.9999999999998447 + q * (-0.16666666665671628 + q * (0.008333333229975641
        + q * (-0.00019841230561730623 + q * (2.7550566908820958e-06 + q * -2.4516186967196084e-08)))));
}

static inline double cosine_of(double x)
{
    const double q = x * x;
    return 0.9999999999999969 + q * (-0.49999999999972833 + q * (0.04166666666279752 + q * (-0.0013888888682176315
        + q * (2.4801534692458978e-05 + q * (-2.755044129698534e-07 + q * 2.0430118711924836e-09)))));
}

#else

static inline double power_of_two(double x) { return exp(0.6931471805599453 * x); }
static inline double logarithm_of_two(double x) { return 1.4426950408889634 * log(x); }
static inline double inverse_sqrt(double x) { return 1.0 / sqrt(x); }
static inline double sine_of(double x) { return sin(x); }
static inline double cosine_of(double x) { return cos(x); }

#endif

struct slices {
    double rho[LANES], entry[LANES], cos_entry[LANES], sin_entry[LANES], normal_y[LANES], lateral_y[LANES];
    double y[LANES], area[LANES], v_x[LANES], rim[LANES], side[LANES], turn[LANES];
    double pressure[LANES], pressure_cos[LANES], pressure_sin[LANES], lateral[LANES], lateral_cos[LANES];
    double lateral_sin[LANES], tangential[LANES], tangential_cos[LANES], tangential_sin[LANES];
};

struct motion { double v_x, v_y, omega, yaw_rate, sinkage; };

static inline void fill_slices(struct slices *restrict s, const double *restrict wheel, const struct motion *m,
                               const double *restrict nodes)
{
    const double minor_radius = wheel[0], half_width = wheel[1], major_radius = wheel[2];
    const double edge = acos(largest(1.0 - m->sinkage / minor_radius, 0.0));
    const double hub_height = minor_radius + major_radius - m->sinkage;
    double sine[LANES], cosine[LANES];
    LANE sine[i] = sin(edge * nodes[i]);
    LANE cosine[i] = cos(edge * nodes[i]);
    LANE s->rho[i] = major_radius + minor_radius * cosine[i];
    LANE s->entry[i] = 2.0 * asin(sqrt(largest((s->rho[i] - hub_height) / (2.0 * s->rho[i]), 0.0)));
    LANE s->cos_entry[i] = cos(s->entry[i]);
    LANE s->sin_entry[i] = sin(s->entry[i]);
    LANE {
        const double a = minor_radius * sine[i], b = half_width * cosine[i];
        const double inverse_d = inverse_sqrt(a * a + b * b);
        s->y[i] = half_width * sine[i];
        s->normal_y[i] = a * inverse_d;
        s->lateral_y[i] = b * inverse_d;
        s->area[i] = s->rho[i] * (a * a + b * b) * inverse_d * edge * nodes[LANES + i] * s->entry[i];
        s->v_x[i] = m->v_x - m->yaw_rate * s->y[i];
        s->rim[i] = m->omega * s->rho[i];
        s->side[i] = s->lateral_y[i] * m->v_y;
        s->turn[i] = s->lateral_y[i] * m->yaw_rate * s->rho[i] - s->normal_y[i] * s->v_x[i];
    }
    memset(s->pressure, 0, 9 * sizeof s->pressure);
}

static inline void add_nodes(struct slices *restrict s, const double *restrict cosine, const double *restrict sine,
                             const double *restrict swept, const double *restrict sigma, double cohesion,
                             double friction, double decay, double weight)
{
    LANE {
        const double strength = weight * (cohesion + sigma[i] * friction), pressure = weight * sigma[i];
        const double v_t = s->v_x[i] * cosine[i] - s->rim[i], v_l = s->side[i] + sine[i] * s->turn[i];
        const double j_t = s->v_x[i] * (s->sin_entry[i] - sine[i]) - s->rim[i] * swept[i];
        const double j_l = s->turn[i] * (cosine[i] - s->cos_entry[i]) + s->side[i] * swept[i];
        const double square = j_t * j_t + (j_l * j_l + 1e-300);
        const double growth = 1.0 - power_of_two(square * inverse_sqrt(square) * decay);
        const double drag = strength * growth * inverse_sqrt(v_t * v_t + (v_l * v_l + 1e-300));
        const double lateral = drag * v_l, tangential = drag * v_t;
        s->pressure[i] += pressure;
        s->pressure_cos[i] += pressure * cosine[i];
        s->pressure_sin[i] += pressure * sine[i];
        s->lateral[i] += lateral;
        s->lateral_cos[i] += lateral * cosine[i];
        s->lateral_sin[i] += lateral * sine[i];
        s->tangential[i] += tangential;
        s->tangential_cos[i] += tangential * cosine[i];
        s->tangential_sin[i] += tangential * sine[i];
    }
}

static inline void add_slices(const struct slices *restrict s, double *restrict wrench)
{
    double f_x[LANES], f_y[LANES], f_z[LANES], m_z[LANES], torque[LANES];
    LANE {
        const double radial_cos = s->lateral_y[i] * s->pressure_cos[i] - s->normal_y[i] * s->lateral_cos[i];
        const double radial_sin = s->lateral_y[i] * s->pressure_sin[i] - s->normal_y[i] * s->lateral_sin[i];
        f_x[i] = -s->area[i] * (s->tangential_cos[i] + radial_sin);
        f_y[i] = -s->area[i] * (s->lateral_y[i] * s->lateral[i] + s->normal_y[i] * s->pressure[i]);
        f_z[i] = s->area[i] * (radial_cos - s->tangential_sin[i]);
        m_z[i] = -s->rho[i] * s->area[i] * (s->lateral_y[i] * s->lateral_sin[i] + s->normal_y[i] * s->pressure_sin[i])
            - s->y[i] * f_x[i];
        torque[i] = s->rho[i] * s->area[i] * s->tangential[i];
    }
    for (int i = 0; i < LANES; i++) {
        wrench[0] += f_x[i];
        wrench[1] += f_y[i];
        wrench[2] += f_z[i];
        wrench[3] += m_z[i];
        wrench[4] += torque[i];
    }
}

/* wheel: minor radius, half width, major radius. soil: as layout.SOIL_PARAMETERS. section: blocks of LANES sin(v) and
   LANES weights. contact: count u^2, then count weights. */
static void integrate_patch(const double *restrict wheel, const double *restrict soil, const struct motion *m,
                            double shear_rate, double rest_speed, const double *restrict section, int section_nodes,
                            const double *restrict contact, int contact_nodes, double *restrict wrench)
{
    const double outer_radius = wheel[0] + wheel[2], rim = outer_radius * m->omega;
    const double edge_sine = sqrt(largest(m->sinkage * (2.0 * wheel[0] - m->sinkage), 0.0)) / wheel[0];
    const double slip = (rim - m->v_x) / largest(largest(fabs(rim), fabs(m->v_x)), 0.5 * rest_speed);
    const double peak = smallest(largest(soil[6] + soil[7] * slip, 0.0), 0.9);
    const double modulus = soil[3] / (2.0 * wheel[1] * edge_sine) + soil[4];
    const double rate = largest(largest(fabs(m->omega), fabs(m->v_x) / outer_radius), shear_rate);
    const double decay = -1.4426950408889634 / (rate * soil[5]);
    const double front = 1.0 - peak, rear = peak + soil[8];
    struct slices s;

    memset(wrench, 0, WRENCH * sizeof *wrench);
    for (int first = 0; first < section_nodes; first += LANES) {
        fill_slices(&s, wheel, m, section + 2 * first);
        for (int k = 0; k < contact_nodes; k++) {
            const double u_squared = contact[k], weight = contact[contact_nodes + k];
            double swept[LANES], sine[LANES], cosine[LANES], sigma[LANES];
            LANE swept[i] = s.entry[i] * (front * u_squared);
            LANE cosine[i] = cosine_of(s.entry[i] - swept[i]);
            LANE sine[i] = sine_of(s.entry[i] - swept[i]);
            LANE sigma[i] = s.rho[i] * cosine[i] - (outer_radius - m->sinkage);
            LANE sigma[i] = modulus * power_of_two(soil[2] * logarithm_of_two(largest(sigma[i], 1e-300)));
            add_nodes(&s, cosine, sine, swept, sigma, soil[0], soil[1], decay, weight * front);
            LANE swept[i] = s.entry[i] * (front + rear - rear * u_squared);
            LANE cosine[i] = cosine_of(s.entry[i] - swept[i]);
            LANE sine[i] = sine_of(s.entry[i] - swept[i]);
            add_nodes(&s, cosine, sine, swept, sigma, soil[0], soil[1], decay, weight * rear);
        }
        add_slices(&s, wrench);
    }
}

/* Wrenches (5 each) of count forward states (v_x, v_y, omega, yaw rate, sinkage), computed again and again. */
void integrate_patches(const double *wheel, const double *soil, const double *states, int count, int repeats,
                       double shear_rate, double rest_speed, const double *section, int section_nodes,
                       const double *contact, int contact_nodes, double *wrenches)
{
    for (int r = 0; r < repeats; r++)
        for (int n = 0; n < count; n++) {
            const double *v = states + 5 * n;
            const struct motion m = {v[0], v[1], v[2], v[3], v[4]};
            integrate_patch(wheel, soil, &m, shear_rate, rest_speed, section, section_nodes, contact, contact_nodes,
                            wrenches + WRENCH * n);
        }
}
