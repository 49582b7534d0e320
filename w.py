    print(seed,round(U.lead_of_named(ex,d),2),d.driver,[(f.slug,round(f.probability,3)) for f in c.found])
