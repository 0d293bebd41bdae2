/* Truths to test the library against, from strongest to weakest: closed forms; the exact area of a
 * union of polygons; brute force over samples. All in double, sharing nothing with the library but
 * its header. They are tested against each other first (self.c). */
#ifndef TESTS_ORACLE_H
#define TESTS_ORACLE_H

#include "scenes.h"

/* ---- A light as one point sees it (design: techniques.md) --------------------------------------
 * The light's points are  p + c + s a + t b,  (s, t) in the unit disk or the square [-1,1]^2. */
typedef struct oracle_view {
    double c[3], a[3], b[3], normal[3]; /* unit, on the side where the light emits */
    double t_end;                       /* occluders count for 0 < t < t_end */
    bool disk, inside;
} oracle_view;

oracle_view oracle_see(const softshadow_light *light, const double p[3]);

/* ---- Closed forms -----------------------------------------------------------------------------*/

/* 1. Part of a unit disk on one side of a line; t = the line's signed distance from the centre, +
 * where the centre is seen. */
double oracle_edge(double t);
/* 2. The same for a limb-darkened disk, I = 1 - u1 (1 - mu) - u2 (1 - mu)^2. */
double oracle_limb_edge(double t, double u1, double u2);
double oracle_limb(double rho, double u1, double u2);
/* 3. Disk of radius a (the light) behind one of radius b, centres c apart. */
double oracle_disks(double a, double b, double c);
/* Spheres of angular radii alpha (the light) and beta, theta apart, by solid angle: two caps. The
 * half-angle form; the textbook's acos form loses digits on small lights. */
double oracle_caps(double alpha, double beta, double theta);
/* 4. Interval [a0, a1] of [-1, 1] that is covered, as a fraction. */
double oracle_overlap(double a0, double a1);
/* The straight edge from q0 to q1 (world) before a disk-shaped view; seen is any world point whose
 * projection lies on the visible side. */
double oracle_edge_before(const oracle_view *view, const double p[3], const double q0[3],
                          const double q1[3], const double seen[3]);
/* 11. Irradiance of a convex polygon (corners relative to the point) on a surface of unit normal n,
 * all of it above the horizon: 1/(2 pi) sum theta_i (n . Gamma_i), sign dropped. */
double oracle_polygon_irradiance(const double (*corners)[3], size_t n, const double normal[3]);

/* ---- The union of triangles before the light, exactly -----------------------------------------*/

/* V, uniform measure: triangles are clipped to the light's pyramid (and to t_end), projected, and
 * the area of their union inside the shape is summed between all crossings. normal: what is below
 * its horizon is hidden; or NULL. Triangles that contain p are ignored. */
double oracle_union(const scene_mesh *mesh, const softshadow_light *light, const double p[3],
                    const double normal[3]);
/* The same for a light with a radial profile (any weight of rho in 0..1), through the area within
 * rings: `rings` Gauss intervals. */
double oracle_union_profile(const scene_mesh *mesh, const softshadow_light *light,
                            const double p[3], double (*profile)(double rho, void *user),
                            void *user, unsigned rings);

/* ---- Every triangle x every sample
 * -------------------------------------------------------------*/

/* V in any weighting (SOFTSHADOW_UNIFORM ...) and with the light's own profile, on about `samples`
 * samples of a regular pattern. */
double oracle_brute(const scene_mesh *mesh, const softshadow_light *light, const double p[3],
                    const double normal[3], uint32_t weighting, unsigned samples);

#endif
