/* The contact kernel of ddagr_gym/physics/contact_patch.py in C: same formulas, same loops, libm functions.

   Only benchmarks/speed.py uses it, to show what the compiled Python costs against a C compiler. */

#include <math.h>

enum { LANES = 8, WRENCH = 5 };

static double largest(double a, double b) { return a > b ? a : b; }
static double smallest(double a, double b) { return a < b ? a : b; }

static double slip_ratio(double rim_speed, double v_x)
{
    double size = largest(fabs(rim_speed), fabs(v_x));
    return size == 0.0 ? 0.0 : copysign(1.0, rim_speed + v_x) * (rim_speed - v_x) / size;
}


struct section { double rho[LANES], entry[LANES], cos_entry[LANES], sin_entry[LANES], normal_y[LANES], lateral_y[LANES], v_local[LANES], y_local[LANES], area[LANES]; };

static inline void add_nodes(const struct section *restrict s, const double *restrict cosine, const double *restrict sine, const double *restrict swept, const double *restrict sigma, double v_y, double omega, double yaw_rate, double cohesion, double friction, double decay, double weight, double (*restrict sum)[LANES])
{
    _Pragma("omp simd") for (int i = 0; i < LANES; i++) {
        const double element = s->area[i] * weight;
        const double strength = cohesion + sigma[i] * friction;
        const double turn = s->lateral_y[i] * yaw_rate * s->rho[i] - s->normal_y[i] * s->v_local[i];
        const double v_t = s->v_local[i] * cosine[i] - omega * s->rho[i];
        const double v_l = s->lateral_y[i] * v_y + sine[i] * turn;
        const double j_t = s->v_local[i] * (s->sin_entry[i] - sine[i]) - omega * s->rho[i] * swept[i];
        const double j_l = turn * (cosine[i] - s->cos_entry[i]) + s->lateral_y[i] * v_y * swept[i];
        const double j = sqrt(j_t * j_t + j_l * j_l);
        const double speed = sqrt(v_t * v_t + v_l * v_l + 1e-300);
        const double drag = -element * strength * (1.0 - exp(j * decay)) / speed;
        const double pressure = element * sigma[i];
        const double radial = pressure * s->lateral_y[i] + drag * v_l * s->normal_y[i];
        const double f_x = drag * v_t * cosine[i] - radial * sine[i];
        const double f_y = drag * v_l * s->lateral_y[i] - pressure * s->normal_y[i];
        sum[0][i] += f_x;
        sum[1][i] += f_y;
        sum[2][i] += drag * v_t * sine[i] + radial * cosine[i];
        sum[3][i] += s->rho[i] * sine[i] * f_y - s->y_local[i] * f_x;
        sum[4][i] -= s->rho[i] * drag * v_t;
    }
}

/* wheel: minor radius, half width, major radius. soil: as layout.SOIL_PARAMETERS.
   section: blocks of LANES sin(v) and LANES weights. contact: count u^2, then count weights. */
static void integrate_patch(const double *wheel, const double *soil, double v_x, double v_y, double omega,
                            double yaw_rate, double sinkage, double minimum_shear_rate, const double *section,
                            int section_nodes, const double *contact, int contact_nodes, double *wrench)
{
    const double minor_radius = wheel[0], half_width = wheel[1], major_radius = wheel[2];
    const double cohesion = soil[0], friction = soil[1], exponent = soil[2], exit_ratio = soil[8];
    const double outer_radius = minor_radius + major_radius;
    const double edge = acos(largest(1.0 - sinkage / minor_radius, 0.0));
    const double slip = slip_ratio(outer_radius * omega, v_x);
    const double peak = smallest(largest(soil[6] + soil[7] * slip, 0.0), 0.9);
    const double modulus = soil[3] / (2.0 * half_width * sin(edge)) + soil[4];
    const double rate = largest(largest(fabs(omega), fabs(v_x) / outer_radius), minimum_shear_rate);
    const double decay = -1.0 / (rate * soil[5]);
    const double front = 1.0 - peak, rear = peak + exit_ratio, full = 1.0 + exit_ratio;
    double sum[WRENCH][LANES] = {{0.0}};

    for (int first = 0; first < section_nodes; first += LANES) {
        struct section section_;
        double *rho = section_.rho, *entry = section_.entry, *cos_entry = section_.cos_entry, *sin_entry = section_.sin_entry, *normal_y=section_.normal_y, *lateral_y=section_.lateral_y, *v_local=section_.v_local, *y_local=section_.y_local, *area=section_.area;
        _Pragma("omp simd") for (int i = 0; i < LANES; i++) {
            double psi = edge * section[2 * first + i];
            double weight = edge * section[2 * first + LANES + i];
            double a = minor_radius * sin(psi), b = half_width * cos(psi);
            double d = sqrt(a * a + b * b);
            rho[i] = major_radius + minor_radius * cos(psi);
            cos_entry[i] = smallest((outer_radius - sinkage) / rho[i], 1.0);
            entry[i] = acos(cos_entry[i]);
            sin_entry[i] = sin(entry[i]);
            normal_y[i] = a / d;
            lateral_y[i] = b / d;
            y_local[i] = half_width * sin(psi);
            v_local[i] = v_x - yaw_rate * y_local[i];
            area[i] = rho[i] * d * weight * entry[i];
        }
        for (int k = 0; k < contact_nodes; k++) {
            const double u_squared = contact[k], weight = contact[contact_nodes + k];
            double swept[LANES], sine[LANES], cosine[LANES], sigma[LANES];
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                swept[i] = entry[i] * front * u_squared;
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                cosine[i] = cos(entry[i] - swept[i]);
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                sine[i] = sin(entry[i] - swept[i]);
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                sigma[i] = modulus * exp(exponent * log(largest(rho[i] * (cosine[i] - cos_entry[i]), 1e-300)));
            add_nodes(&section_, cosine, sine, swept, sigma, v_y, omega, yaw_rate, cohesion, friction, decay, weight * front, sum);
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                swept[i] = entry[i] * (full - rear * u_squared);
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                cosine[i] = cos(entry[i] - swept[i]);
            _Pragma("omp simd") for (int i = 0; i < LANES; i++)
                sine[i] = sin(entry[i] - swept[i]);
            add_nodes(&section_, cosine, sine, swept, sigma, v_y, omega, yaw_rate, cohesion, friction, decay, weight * rear, sum);
        }
    }
    for (int j = 0; j < WRENCH; j++) {
        wrench[j] = 0.0;
        _Pragma("omp simd") for (int i = 0; i < LANES; i++)
            wrench[j] += sum[j][i];
    }
}

/* Wrenches (5 each) of count states (v_x, v_y, omega, yaw rate, sinkage), repeated. */
void integrate_patches(const double *wheel, const double *soil, const double *states, int count, int repeats,
                       double minimum_shear_rate, const double *section, int section_nodes, const double *contact,
                       int contact_nodes, double *wrenches)
{
    for (int r = 0; r < repeats; r++)
        for (int n = 0; n < count; n++) {
            const double *s = states + 5 * n;
            integrate_patch(wheel, soil, s[0], s[1], s[2], s[3], s[4], minimum_shear_rate, section, section_nodes,
                            contact, contact_nodes, wrenches + WRENCH * n);
        }
}
